// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "hexsolver/dynamics/motion.h"
#include "hexsolver/equilibrium/equilibrium.h"
#include "support/bodies.h"

namespace test_friction {

using namespace hexsolver;
using namespace testing_support;

constexpr double earth = 9810, mu = 0.5;  // [mm/s^2]

Contact floor_at(double height, double friction) {
  Contact floor;
  floor.name = "floor";
  floor.obstacle = HalfSpace{{0, 0, height}, {0, 0, 1}};
  floor.friction = friction;
  return floor;
}

/// A block of 20 mm on a slope: what turns is gravity. It begins as deep in the floor as bears it.
struct Slope {
  explicit Slope(double tangent, double friction, double seconds, Integrator integrator = Integrator::bdf2) {
    const double angle = std::atan(tangent), stiffness = 10 * young * 5;
    const double weight = 8000 * 1e-9 * earth * std::cos(angle);
    scene.gravity = earth * Vec3(std::sin(angle), 0, -std::cos(angle));
    scene.contacts = {floor_at(-2.5 + weight / (16 * stiffness), friction)};
    Dynamics d;
    d.step = 1e-3;
    d.duration = seconds;
    d.integrator = integrator;
    scene.dynamics = d;
    scene.finds_strain = false;
  }
  static constexpr double young = 1;  // [MPa]
  const Lattice lattice = box({4, 4, 4}, {5, 5, 5}, 1e3 * young);
  Scene scene;
};

Vec3 mean(const NodeVector& field) { return field.reshaped(3, field.size() / 3).rowwise().mean(); }

TEST(Friction, ABlockRestsOnASlopeBelowItsAngle) {
  Slope slope(0.95 * mu, mu, 0.3);
  Motion motion(slope.lattice, slope.scene, 1);
  Vec3 before = Vec3::Zero();
  for (int n = 0; n < 300; ++n) {
    ASSERT_TRUE(motion.step()) << motion.reason();
    if (n == 150) before = mean(motion.displacement());
  }
  EXPECT_LT(mean(motion.displacement()).norm(), 0.05);  // gravity comes at once: it slips until its springs are drawn
  EXPECT_LT((mean(motion.displacement()) - before).norm(), 1e-3);
}

TEST(Friction, ABlockSlidesDownASteeperSlope) {
  for (const Integrator integrator : {Integrator::implicit_euler, Integrator::bdf2}) {
    constexpr double tangent = 0.8;
    Slope slope(tangent, mu, 0.2, integrator);
    Motion motion(slope.lattice, slope.scene, 1);
    Vec3 before = Vec3::Zero();
    double energy = 0, work = 0;
    for (int n = 0; n < 200; ++n) {
      ASSERT_TRUE(motion.step()) << motion.reason();
      if (n != 99) continue;
      before = mean(motion.velocity());
      energy = motion.energies().total();
      work = motion.friction_work();
    }
    const double acceleration = (mean(motion.velocity()) - before)[0] / 0.1;
    const double expected = earth * std::cos(std::atan(tangent)) * (tangent - mu);
    EXPECT_NEAR(acceleration, expected, 0.01 * expected);
    const double taken = motion.friction_work() - work, lost = energy - motion.energies().total();
    EXPECT_GT(taken, 0);
    EXPECT_NEAR(lost, taken, 0.01 * taken);
    EXPECT_EQ(motion.contacts()[0].slipping, motion.contacts()[0].points);
  }
}

/// Two blocks on a floor, the first pulled ever more strongly, a soft strap between them: it goes once the pull is all
/// its friction, and the second once it is that of both.
TEST(Friction, OfAChainOfBlocksOneSlipsAfterTheOther) {
  constexpr double seconds = 2, most = 0.1, slipped = 0.02;  // N, mm
  const hexmesh::LabelVolume volume = make_volume({11, 4, 4}, {5, 5, 5}, [](const Index3& v) {
    if (v[0] < 4 || v[0] > 6) return 1;
    return v[2] == 2 && (v[1] == 1 || v[1] == 2) ? 2 : 0;
  });
  const Lattice lattice = hexmesh::build_lattice(volume,
                                                 {{{1, "block"}, hexmesh::material_from_units(1e3, 0.3, 1000), 0, ""},
                                                  {{2, "strap"}, hexmesh::material_from_units(20, 0.3, 1), 0, ""}},
                                                 {3, {0, 0, 0}, {}});
  const double weight = 8000 * 1e-9 * earth;
  Scene scene;
  scene.gravity = {0, 0, -earth};
  scene.finds_strain = false;
  scene.contacts = {floor_at(-2.5 + weight / (16 * 10 * 5), mu)};
  Force pull;
  pull.name = "pull";
  pull.selection.halfspace = HalfSpace{{52.4, 0, 0}, {1, 0, 0}};
  pull.history = History{{{0, Vec3::Zero()}, {seconds, Vec3(most, 0, 0)}}};
  scene.forces = {pull};
  Dynamics d;
  d.step = 4e-3;
  d.duration = seconds;
  scene.dynamics = d;
  Motion motion(lattice, scene, 0);
  double first = 0, second = 0;  // N, when each goes
  while (second == 0 && motion.time() < seconds - 1e-9) {
    ASSERT_TRUE(motion.step()) << motion.reason();
    const double force = most * motion.time() / seconds;
    double ahead = 0, behind = 0;
    for (std::size_t n = 0; n < motion.mesh().num_nodes(); ++n) {
      const double along = motion.displacement()[3 * static_cast<Eigen::Index>(n)], at = motion.mesh().position(n)[0];
      if (at > 52) ahead = std::max(ahead, along);
      if (at < -2) behind = std::max(behind, along);
    }
    if (first == 0 && ahead > slipped) first = force;
    if (second == 0 && behind > slipped) second = force;
  }
  std::printf("one block of %.4f N friction goes at %.4f N, both at %.4f N\n", mu * weight, first, second);
  const double strap = 20e-3 * 50 / 15;  // N/mm, E A / length: what it pulls with as the first has slipped
  EXPECT_NEAR(first, mu * weight + strap * slipped, 0.02 * mu * weight);
  EXPECT_NEAR(second, 2 * mu * weight, 0.02 * 2 * mu * weight);
}

/// Without friction the energy stays what it was.
TEST(Friction, NoneTakesNothing) {
  Slope slope(0.8, 0, 0.1);
  Motion motion(slope.lattice, slope.scene, 1);
  for (int n = 0; n < 100; ++n) ASSERT_TRUE(motion.step()) << motion.reason();
  EXPECT_EQ(motion.friction_work(), 0);
  EXPECT_NEAR(mean(motion.velocity())[0], earth * std::sin(std::atan(0.8)) * 0.1, 1e-3 * earth);
}

/// A floor that rises lifts a block: its work is what the block has then, whatever the step.
TEST(Friction, AFloorThatRisesGivesItsWork) {
  for (const double step : {1e-3, 4e-3})
    for (const double friction : {0.0, 0.5}) {
      Slope slope(0, friction, 0.2);
      slope.scene.contacts[0].history = History{{{0, Vec3::Zero()}, {1, Vec3(0, 0, 100)}}};
      slope.scene.dynamics->step = step;
      Motion motion(slope.lattice, slope.scene, 1);
      const double before = motion.energies().total();
      while (motion.time() < 0.2 - 1e-9) ASSERT_TRUE(motion.step()) << motion.reason();
      const double gained = motion.energies().total() - before;
      const double expected = 8000 * 1e-9 * (earth * 20 + 100 * 100 / 2.0);
      EXPECT_NEAR(gained, expected, 0.02 * expected);
      EXPECT_NEAR(motion.work(), gained, 0.05 * gained + motion.work_uncertainty());
    }
}

/// In equilibrium: pressed to a floor by N and pulled along it a block goes with the pull beyond mu N, and holds it
/// before.
TEST(Friction, HoldsInEquilibriumUpToItsLimit) {
  const Lattice lattice = box({8, 4, 4}, {5, 5, 5}, 1e3);
  for (const double pull : {0.1, 0.4, 3.0}) {
    Scene s;
    s.contacts = {floor_at(-2.5, mu)};
    s.contacts[0].stiffness = 2;
    Condition top;
    top.name = "top";
    top.selection.halfspace = HalfSpace{{0, 0, 17.4}, {0, 0, 1}};
    top.by = {0, 0, -0.2};
    s.conditions = {top};
    s.contacts[0].by = {pull, 0, 0};  // the floor moves away below
    s.elasticity = Elasticity::corotational;
    s.error_estimation = ErrorEstimation::off;
    SolveReport report;
    const Outcome out = solve_equilibrium(lattice, s, 1);
    ASSERT_TRUE(out.report.converged) << out.report.reason;
    const Vec3 force = out.report.contacts[0].force_n;
    const double normal = force[2], along = std::hypot(force[0], force[1]);
    EXPECT_GT(normal, 1);
    EXPECT_LE(along, mu * normal * (1 + 1e-6));
    if (pull == 3.0) {
      EXPECT_NEAR(force[0], mu * normal, 2e-2 * mu * normal);
    }
    if (pull == 3.0) {
      EXPECT_GE(4 * out.report.contacts[0].slipping, 3 * out.report.contacts[0].points);
    }
    if (pull == 0.1) {
      EXPECT_LT(along, 0.8 * mu * normal);
    }
    EXPECT_LT(out.report.balance.sum().force_n.norm(), 1e-6);
  }
}

/// A body that nothing but a floor carries: it comes down to it and rests, as deep in its springs as bears it.
TEST(Carried, ABlockRestsOnAFloor) {
  for (const double angle : {0.0, 0.3}) {
    const Mat3 turn = Eigen::AngleAxisd(angle, Vec3::UnitY()).toRotationMatrix();
    hexmesh::LabelVolume volume = make_volume(
        {6, 4, 4}, {5, 5, 5}, [](const Index3&) { return 1; }, turn);
    const Lattice lattice = hexmesh::build_lattice(
        volume, {{volume.segments[0], hexmesh::material_from_units(50, 0.3, 1000), 0, ""}}, {3, {0, 0, 0}});
    Scene s;
    s.elasticity = Elasticity::corotational;
    s.gravity = Vec3(0, 0, -earth);
    s.contacts = {floor_at(-20, 0)};
    for (const int level : {1, 0}) {
      const Outcome out = solve_equilibrium(lattice, s, level);
      ASSERT_TRUE(out.report.converged) << out.report.reason;
      const double weight = 30 * 20 * 20 * 1e-9 * earth;
      EXPECT_NEAR(out.report.contacts[0].force_n[2], weight, 1e-5 * weight);
      EXPECT_LT(out.report.contacts[0].force_n.head<2>().norm(), 1e-5 * weight);
      EXPECT_LT(out.report.balance.sum().moment_n_mm.norm(), 1e-3 * weight * 30);
      EXPECT_LT(out.report.contacts[0].deepest_mm, 0.02);
      EXPECT_GE(out.report.contacts[0].points, 24U);  // on its side, not its edge
    }
  }
}

TEST(Carried, ABodyThatNothingStopsIsNoSolution) {
  const Lattice lattice = box({4, 4, 4}, {5, 5, 5});
  Scene s;
  s.elasticity = Elasticity::corotational;
  s.gravity = Vec3(0, 0, -earth);
  s.contacts = {floor_at(-20, 0)};
  s.contacts[0].obstacle = HalfSpace{{0, 0, 40}, {0, 0, -1}};
  const Outcome out = solve_equilibrium(lattice, s, 1);
  EXPECT_FALSE(out.report.converged);
  EXPECT_NE(out.report.reason.find("nothing stops the body"), std::string::npos) << out.report.reason;
}

}  // namespace test_friction
