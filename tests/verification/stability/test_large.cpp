// SPDX-License-Identifier: Apache-2.0
// Large rotations and large pulls.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "motions.h"
#include "record.h"
#include "statics.h"
#include "support/experiments.h"
#include "support/solve.h"

namespace test_large {

using namespace hexsolver;
using namespace testing_support;
using stability::Case;

constexpr const char* rotations = "06 large rotation";
constexpr const char* pulls = "07 large pulls";
constexpr double degree = std::numbers::pi / 180;

constexpr double spacing = 2;
constexpr int across = 4, along = 48;
Lattice bar() { return box({along, across, across}, Vec3::Constant(spacing), 100, 0.3); }
constexpr double left = -0.5 * spacing, right = (along - 0.5) * spacing;
const Vec3 axis_point(0, (across - 1) / 2.0 * spacing, (across - 1) / 2.0 * spacing);

bool at_left(const Vec3& p) { return p[0] < left + 0.1 * spacing; }
bool at_right(const Vec3& p) { return p[0] > right - 0.1 * spacing; }

/// The ends turned about the bar's axis by +-half the angle. The bar is stretched by a twentieth: a slack one buckles
/// sideways at 600 to 700 degrees, as rods do (Greenhill).
std::vector<ConstraintPoint> twisted(const Mesh& mesh, double angle) {
  return hold_nodes(
      mesh, [](const Vec3& p) { return at_left(p) || at_right(p); },
      [&](const Vec3& p) -> Vec3 {
        const Mat3 r = Eigen::AngleAxisd(at_left(p) ? -angle / 2 : angle / 2, Vec3::UnitX()).toRotationMatrix();
        return r * (p - axis_point) + axis_point - p + (at_left(p) ? 0 : 0.05 * (right - left)) * Vec3::UnitX();
      });
}

/// The bar's sections turned and moved onto a circle of the length of the bar, about its middle.
Vec3 bent(const Vec3& p, double angle) {
  const double length = right - left, s = p[0] - (left + right) / 2, y = p[1] - axis_point[1];
  const double radius = length / angle, turn = s / radius;
  return Vec3((radius - y) * std::sin(turn) + (left + right) / 2,
              radius - (radius - y) * std::cos(turn) + axis_point[1], p[2]);
}

TEST(LargeRotation, ABarTwistedAndReleased) {
  const Lattice lattice = bar();
  for (int level = 0; level < 2; ++level) {
    if (level == 0 && !stability::is_full()) continue;
    Case c(rotations,
           fmt::format("a bar of {} x {} x {} voxels twisted and released, level {}", along, across, across, level));
    Body body(lattice, level, Elasticity::corotational);
    NodeVector u = NodeVector::Zero(static_cast<Eigen::Index>(body.mesh.num_dofs()));
    std::vector<double> angles, energies;
    int most_steps = 0;
    constexpr double step = 15;
    for (double angle = step; angle <= 720; angle += step) {
      const stability::Descent d = stability::descend(lattice, body, twisted(body.mesh, angle * degree), u, 60);
      most_steps = std::max(most_steps, d.report.iterations);
      if (!d.report.converged) {
        printf("level %d: %g degrees: %s\n", level, angle, d.report.reason.c_str());
        break;
      }
      u = d.u;
      angles.push_back(angle);
      energies.push_back(d.end_energy);
      if (angle == 90 || angle == 180 || angle == 360 || angle == 720) {
        Scene scene = stability::starved(Rotation::polar);
        Motion motion(lattice, scene, level);
        motion.set_state(u, stability::still(motion));
        const stability::Run r = stability::run(motion, 1000);
        EXPECT_TRUE(r.finished) << r.reason;
        const std::string at = fmt::format("{} degrees: ", angle);
        c.at_most(at + "energy left 20 s after release", motion.energies().total() / r.energy[0], 1e-3);
        c.at_most(at + "energy gained in a step", r.largest_gain, 1e-7);
        c.body(fmt::format("level {} twisted by {} degrees", level, angle), body.mesh, u);
      }
    }
    c.at_least("angle that was reached in steps of 15 degrees", angles.empty() ? 0 : angles.back(), 720);
    c.note("most Newton steps for 15 degrees", most_steps);
    c.curve({"twisted bar", "angle [degrees]", "energy [N mm]", false, false}, fmt::format("level {}", level), angles,
            energies);
  }
}

TEST(LargeRotation, ABeamBentIntoARing) {
  const Lattice lattice = bar();
  for (int level = 0; level < 2; ++level) {
    Case c(rotations, fmt::format("a beam bent into a ring, level {}", level));
    Body body(lattice, level, Elasticity::corotational);
    NodeVector u = NodeVector::Zero(static_cast<Eigen::Index>(body.mesh.num_dofs()));
    std::vector<double> angles, energies;
    for (double angle = 15; angle <= 360; angle += 15) {
      const auto held = hold_nodes(
          body.mesh, [](const Vec3& p) { return at_left(p) || at_right(p); },
          [&](const Vec3& p) { return Vec3(bent(p, angle * degree) - p); });
      const stability::Descent d = stability::descend(lattice, body, held, u, 60);
      EXPECT_TRUE(d.report.converged) << angle << ": " << d.report.reason;
      if (!d.report.converged) break;
      u = d.u;
      angles.push_back(angle);
      energies.push_back(d.end_energy);
    }
    // Euler-Bernoulli: E I angle^2 / (2 L).
    const double young = 0.1, side = across * spacing, length = along * spacing;
    const auto expected = [&](double angle) {
      return young * std::pow(side, 4) / 12 * std::pow(angle * degree, 2) / (2 * length);
    };
    for (const auto& [angle, energy] : {std::pair{15, energies.front()}, std::pair{360, energies.back()}})
      c.at_most(fmt::format("bending energy at {} degrees over that of a thin beam, off 1", angle),
                std::abs(energy / expected(angle) - 1), 0.1);
    c.at_most("energy at 360 degrees over 576 times that at 15 degrees, off 1",
              std::abs(energies.back() / energies.front() / 576 - 1), 0.2);
    c.body(fmt::format("ring, level {}", level), body.mesh, u);
  }
}

TEST(LargeRotation, ManyTurnsLeaveTheForcesAsAtRest) {
  Case c(rotations, "a body turned by up to 1e4 rad: energy and forces");
  double energy = 0, force = 0;
  for (int level = 0; level < 3; ++level) {
    const Lattice lattice = bitten_ball({2, 2, 2});
    for (const Elasticity e : {Elasticity::corotational, Elasticity::neo_hookean}) {
      const Body body(lattice, level, e);
      for (const double angle : {1.0, 3.0, 100.0, 1e4}) {
        const Mat3 r = Eigen::AngleAxisd(angle, Vec3(1, 2, 3).normalized()).toRotationMatrix();
        const NodeVector u = sample(body.mesh, [&](const Vec3& p) -> Vec3 { return r * p - p; });
        NodeVector gradient, magnitude, still, of_stretch;
        body.potential.gradient(u, gradient, magnitude);
        // The same body stretched by a tenth without turning gives the scale.
        body.potential.gradient(sample(body.mesh, [](const Vec3& p) -> Vec3 { return 0.1 * p; }), still, of_stretch);
        energy = stability::worst(
            energy, body.potential.energy(u) /
                        body.potential.energy(sample(body.mesh, [](const Vec3& p) -> Vec3 { return 0.1 * p; })));
        force = stability::worst(force, gradient.norm() / of_stretch.norm());
      }
    }
  }
  c.at_most("energy over that of a stretch by a tenth", energy, 1e-12);
  c.at_most("force over those of a stretch by a tenth", force, 1e-12);
}

class LargeRotationInMotion : public testing::TestWithParam<Rotation> {};

TEST_P(LargeRotationInMotion, ABodySpunByItsSupport) {
  const double radians = stability::whole_or(1e4, 2e2);
  Case c(rotations, fmt::format("a body spun by {:g} rad by its end, 0.4 rad a step, {}", radians,
                                stability::name_of(GetParam())));
  const Lattice lattice = box({4, 2, 2}, Vec3::Constant(spacing), 1000, 0.3);
  Scene scene;
  scene.rotation = GetParam();
  Dynamics d;
  d.step = 0.4;  // slow: 1 rad/s
  d.duration = radians;
  d.solver = StepSolver::multigrid;
  scene.dynamics = d;
  const Vec3 middle = Vec3(0, 0.5, 0.5) * spacing;
  Condition end = beyond("spun", {left + 0.1 * spacing, 0, 0}, {-1, 0, 0}, Vec3::Zero(), SurfacePoints::nodes);
  end.turn = Turn{Vec3::UnitX(), radians, middle};
  scene.conditions = {end};
  scene.tolerance = 1e-6;
  if (GetParam() == Rotation::edges) {
    scene.dynamics->newton_iterations = 3;
    scene.dynamics->solver_iterations = 10;
  }
  Motion motion(lattice, scene, 0);
  const stability::Run r = stability::run(motion, scene.dynamics->num_steps());
  EXPECT_TRUE(r.finished) << "at " << motion.time() << " s: " << r.reason;
  const Mat3 turn = Eigen::AngleAxisd(motion.time(), Vec3::UnitX()).toRotationMatrix();
  const NodeVector rigid =
      sample(motion.mesh(), [&](const Vec3& p) -> Vec3 { return turn * (p - middle) + middle - p; });
  // Stretched by a tenth: the scale of energies. Turning at 1 rad/s it stores next to nothing.
  const Body body(lattice, 0, Elasticity::corotational);
  const double scale = body.potential.energy(sample(body.mesh, [](const Vec3& p) -> Vec3 { return 0.1 * p; }));
  c.at_most("strain energy over that of a stretch by a tenth", motion.energies().strain / scale, 1e-6);
  c.at_most("distance from the rigid rotation [mm]", (motion.displacement() - rigid).lpNorm<Eigen::Infinity>(), 1e-2);
  c.note("parts of steps that were not accepted", motion.counts().failed);
}

INSTANTIATE_TEST_SUITE_P(Rotations, LargeRotationInMotion, testing::Values(Rotation::polar, Rotation::edges),
                         [](const auto& p) { return stability::name_of(p.param); });

TEST(LargePulls, ALiverPulledBy10To200Millimetres) {
  for (const Elasticity e : {Elasticity::corotational, Elasticity::neo_hookean, Elasticity::stable_neo_hookean}) {
    Case c(pulls, fmt::format("liver, three patches held, the fourth pulled, {}", stability::law_name(e)));
    const Lattice lattice = liver_of_phantom(stability::whole_or(4.0, 6.0), 0.3);
    for (int level = 2; level >= stability::whole_or(0, 1); --level)
      for (const double pull : {10.0, 40.0, 100.0, 200.0}) {
        Scene scene = with(phantom_patches(12), e);
        scene.conditions.back().by *= pull / 40;
        SolveReport report;
        const hexmesh::Result r = solve_equilibrium(lattice, scene, level, report);
        const std::string at = fmt::format("level {}, {:g} mm: ", level, pull);
        if (!report.converged) printf("%s\n", report.reason.c_str());
        // Either all of the load, or the last state in equilibrium and a reason.
        c.at_least(at + "pull that was reached [mm]", report.load_fraction * pull, std::min(pull, 40.0));
        c.at_most(at + "relative residual of what is written", report.relative_residual, scene.tolerance);
        EXPECT_TRUE(report.converged || (report.load_fraction < 1 && !report.reason.empty()));
        for (const Vec3& u : r.displacement) ASSERT_TRUE(u.allFinite());
        // The supports of what is written hold as far as they have been moved.
        c.at_most(at + "constraints off [mm]", report.constraint_violation_mm, 1e-6);
      }
  }
}

}  // namespace test_large
