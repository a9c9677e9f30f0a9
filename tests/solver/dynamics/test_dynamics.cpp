// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "hexmesh/core/error.h"
#include "hexsolver/dynamics/motion.h"
#include "hexsolver/equilibrium/equilibrium.h"
#include "support/bodies.h"
#include "support/solve.h"
#include "terms/corotational.h"
#include "terms/inertia.h"

namespace test_dynamics {

using namespace hexsolver;
using namespace testing_support;

const Vec3 earth(0, 0, -9810);  // mm/s^2

Scene moving(double step, double duration, StepSolver solver = StepSolver::multigrid, int iterations = 0) {
  Scene scene;
  Dynamics d;
  d.step = step;
  d.duration = duration;
  d.solver = solver;
  d.solver_iterations = iterations;
  d.newton_iterations = iterations > 0 ? 1 : 0;
  scene.dynamics = d;
  return scene;
}

Condition held_end(const Vec3& point, const Vec3& normal) {
  Condition c;
  c.name = "end";
  c.where = "test";
  c.selection.halfspace = HalfSpace{point, normal};
  return c;
}

/// A soft bar along x from 0 to 24 mm, 6 mm thick, cells of 2 mm at level 1, held at x = 0.
Lattice bar(double young_kpa = 100, double poisson = 0.3) { return box({24, 6, 6}, {1, 1, 1}, young_kpa, poisson); }

Scene held_bar(Scene scene) {
  scene.conditions = {held_end({-0.5, 0, 0}, {-1, 0, 0})};
  return scene;
}

/// All the ways to solve a step.
struct Way {
  const char* name;
  StepSolver solver;
  int iterations;
  Integrator integrator = Integrator::implicit_euler;
  bool is_graded = false, is_soft = false;
  Stiffness stiffness = Stiffness::exact;
};
void PrintTo(const Way& way, std::ostream* out) { *out << way.name; }
const Way ways[] = {
    {"cg_10", StepSolver::cg, 10},
    {"jacobi_10", StepSolver::jacobi, 10},
    {"multigrid_1", StepSolver::multigrid, 1},
    {"multigrid_2", StepSolver::multigrid, 2},
    {"jacobi_converged", StepSolver::jacobi, 0},
    {"multigrid_converged", StepSolver::multigrid, 0},
    {"bdf2_jacobi_10", StepSolver::jacobi, 10, Integrator::bdf2},
    {"bdf2_converged", StepSolver::multigrid, 0, Integrator::bdf2},
    {"graded_cg_10", StepSolver::cg, 10, Integrator::implicit_euler, true},
    {"graded_jacobi_converged", StepSolver::jacobi, 0, Integrator::implicit_euler, true},
    {"graded_multigrid_2", StepSolver::multigrid, 2, Integrator::implicit_euler, true},
    {"graded_bdf2_converged", StepSolver::multigrid, 0, Integrator::bdf2, true},
    {"soft_multigrid_2", StepSolver::multigrid, 2, Integrator::implicit_euler, false, true, Stiffness::incompatible},
    {"soft_bdf2_converged", StepSolver::multigrid, 0, Integrator::bdf2, false, true, Stiffness::incompatible}};

class EveryWay : public testing::TestWithParam<Way> {
protected:
  Scene scene(double step, double duration) const {
    Scene s = moving(step, duration, GetParam().solver, GetParam().iterations);
    s.dynamics->integrator = GetParam().integrator;
    if (GetParam().is_graded) s.grading = Grading::scene;
    if (GetParam().is_soft) s.supports = Supports::soft;
    s.stiffness = GetParam().stiffness;
    return s;
  }
  bool is_bdf2() const { return GetParam().integrator == Integrator::bdf2; }
};

/// The energy never grows but by what is given to the body; with `in_all` by a thousandth above what it had at
/// the start, while steps may give back what steps have taken.
void expect_energy_never_grows(Motion& motion, int steps, bool in_all = false) {
  const double first = motion.energies().total();
  double before = first, work_before = 0, uncertain_before = 0, largest = std::abs(first);
  for (int n = 0; n < steps; ++n) {
    ASSERT_TRUE(motion.step()) << motion.reason() << " after " << n << " steps";
    const double now = motion.energies().total(),
                 given = motion.work() - work_before + motion.work_uncertainty() - uncertain_before;
    largest = std::max({largest, std::abs(now), motion.energies().kinetic});
    ASSERT_LE(now, before + given + (in_all ? 1e-3 : 1e-8) * largest) << "step " << n;
    if (in_all) continue;
    before = now;
    work_before = motion.work();
    uncertain_before = motion.work_uncertainty();
  }
}

TEST_P(EveryWay, FreeFallIsThatOfTheFormulaAtEveryLevel) {
  const Lattice lattice = bitten_ball({1, 1, 1});
  for (int level = 0; level < 4; ++level) {
    constexpr double h = 0.01;
    constexpr int steps = 50;
    Scene s = scene(h, 1);
    s.gravity = earth;
    Motion motion(lattice, s, level);
    for (int n = 0; n < steps; ++n) ASSERT_TRUE(motion.step()) << motion.reason();
    const Vec3 velocity = steps * h * earth,
               position = h * h * (is_bdf2() ? steps * steps : steps * (steps + 1)) / 2.0 * earth;
    double worst = 0, worst_velocity = 0;
    for (Eigen::Index n = 0; n < motion.velocity().size(); n += 3) {
      worst_velocity = std::max(worst_velocity, (motion.velocity().segment<3>(n) - velocity).norm());
      worst = std::max(worst, (motion.displacement().segment<3>(n) - position).norm());
    }
    EXPECT_LT(worst_velocity, 1e-9 * velocity.norm()) << "level " << level;
    EXPECT_LT(worst, 1e-9 * position.norm()) << "level " << level;
  }
}

TEST_P(EveryWay, TheEnergyNeverGrowsWithoutWork) {
  struct Case {
    const char* name;
    double young_kpa, step;
    bool contact;
  };
  for (const Case& c :
       {Case{"stiff", 1e6, 0.005, false}, Case{"soft", 5, 0.005, false}, Case{"contact", 30, 0.002, true}}) {
    SCOPED_TRACE(c.name);
    const Lattice lattice = bar(c.young_kpa);
    Scene s = scene(c.step, 1000 * c.step);
    s.gravity = earth;
    if (c.contact) {
      Contact floor;
      floor.name = "floor";
      floor.obstacle = HalfSpace{{0, 0, -3}, {0, 0, 1}};
      floor.stiffness = 0.2;
      s.contacts = {floor};
    } else {
      s = held_bar(s);
    }
    Motion motion(lattice, s, 1);
    expect_energy_never_grows(motion, 1000, is_bdf2());
    if (c.contact) {
      EXPECT_GT(motion.energies().contact, 0);  // lies on the floor
    }
  }
}

TEST_P(EveryWay, ComesToRestWhereTheEquilibriumIs) {
  const Lattice lattice = bar(30);
  Scene still;
  still.gravity = earth;
  still.conditions = {held_end({-0.5, 0, 0}, {-1, 0, 0})};
  Scene s = scene(0.02, 10);
  still.grading = s.grading;
  still.supports = s.supports;
  still.stiffness = s.stiffness;
  SolveReport report;
  const hexmesh::Result at_rest = solve_equilibrium(lattice, still, 1, report);
  s.gravity = earth;
  s.conditions = still.conditions;
  s.damping = {5, 0.005};
  Motion motion(lattice, s, 1);
  for (int n = 0; n < 500; ++n) ASSERT_TRUE(motion.step()) << motion.reason();
  double worst = 0;
  for (std::size_t n = 0; n < at_rest.displacement.size(); ++n)
    worst = std::max(
        worst, (motion.displacement().segment<3>(3 * static_cast<Eigen::Index>(n)) - at_rest.displacement[n]).norm());
  EXPECT_LT(worst, 1e-3);
}

INSTANTIATE_TEST_SUITE_P(Solvers, EveryWay, testing::ValuesIn(ways), [](const auto& p) { return p.param.name; });

TEST(Motion, EnergiesAreThoseOfTheState) {
  // Again from displacement and velocity alone. A full box: each cell gives an eighth of its mass to each corner.
  const Lattice lattice = bar();
  for (int level = 0; level < 2; ++level) {
    Scene scene = held_bar(moving(0.01, 1, StepSolver::cg, 10));
    scene.gravity = earth;
    Motion motion(lattice, scene, level);
    const Body body(lattice, level, Elasticity::corotational);
    const double density = lattice.materials[0].material.density;
    const double share = density * lattice.cell_size(level).prod() / 8;
    for (int n = 0; n < 20; ++n) {
      ASSERT_TRUE(motion.step()) << motion.reason();
      double kinetic = 0, loads = 0;
      for (std::size_t c = 0; c < body.mesh.num_cells(); ++c)
        for (const std::int32_t node : body.mesh.cell_nodes()[c]) {
          kinetic += share / 2 * motion.velocity().segment<3>(3 * Eigen::Index{node}).squaredNorm();
          loads -= share * earth.dot(motion.displacement().segment<3>(3 * Eigen::Index{node}));
        }
      const Energies& told = motion.energies();
      EXPECT_NEAR(told.kinetic, kinetic, 1e-12 * kinetic);
      EXPECT_NEAR(told.loads, loads, 1e-12 * std::abs(loads));
      EXPECT_NEAR(told.strain, body.potential.energy(motion.displacement()), 1e-12 * told.strain);
    }
  }
}

TEST(Motion, ConservesLinearMomentumWithoutForces) {
  const Lattice lattice = bitten_ball({1, 1, 1});
  Scene s = moving(0.01, 1);
  s.damping.stiffness_s = 0.003;
  Motion motion(lattice, s, 1);
  // Strained, turning and flying at once.
  const NodeVector u =
      sample(motion.mesh(), [](const Vec3& p) { return Vec3(0.002 * p[1] * p[1], 0.1 * p[2], 0.05 * p[0]); });
  const NodeVector v =
      sample(motion.mesh(), [](const Vec3& p) { return Vec3(Vec3(3, 5, -4).cross(p) + Vec3(100, 200, -50)); });
  motion.set_state(u, v);
  const Vec3 before = motion.momentum();
  for (int n = 0; n < 100; ++n) {
    ASSERT_TRUE(motion.step()) << motion.reason();
    ASSERT_LT((motion.momentum() - before).norm(), 1e-10 * before.norm()) << "step " << n;
  }
}

TEST(Motion, DampingOfTheStepsFallsWithTheirSizeToFirstOrder) {
  const Lattice lattice = bar(300);
  Scene s = held_bar(moving(1e-3, 1));
  s.elasticity = Elasticity::cauchy;
  // Large steps leave nothing but the first mode, some 30 Hz.
  Motion settle(lattice, s, 1);
  settle.set_state(NodeVector::Zero(settle.velocity().size()),
                   sample(settle.mesh(), [](const Vec3& p) { return Vec3(0, 0, p[0] * p[0]); }));
  for (int n = 0; n < 100; ++n) ASSERT_TRUE(settle.step());
  const auto lost = [&](double h, double stiffness_s = 0) {
    s.dynamics->step = h;
    s.damping.stiffness_s = stiffness_s;
    Motion motion(lattice, s, 1);
    motion.set_state(settle.displacement(), settle.velocity());
    const double before = motion.energies().total();
    while (motion.time() < 0.1 - 1e-9) EXPECT_TRUE(motion.step()) << motion.reason();
    return std::log(before / motion.energies().total());
  };
  // The energy of a mode falls as exp(-omega^2 h t).
  const double coarse = lost(2e-4), middle = lost(1e-4), fine = lost(5e-5);
  EXPECT_NEAR(coarse / middle, 2, 0.05);
  EXPECT_NEAR(middle / fine, 2, 0.025);
  // Damping in proportion b to the stiffness takes exp(-omega^2 b t) over whole periods, as much as steps of b do.
  EXPECT_NEAR(lost(5e-5, 5e-5) / fine, 2, 0.1);
}

TEST(Motion, DampingInProportionToTheMassSlowsAllThatFlies) {
  const Lattice lattice = bar();
  Scene s = moving(0.01, 1);
  s.dynamics->velocity = Vec3(100, 0, -50);
  s.damping.mass_per_s = 3;
  Motion motion(lattice, s, 1);
  for (int n = 0; n < 40; ++n) ASSERT_TRUE(motion.step()) << motion.reason();
  const Vec3 expected = s.dynamics->velocity / std::pow(1 + 3 * 0.01, 40);
  for (Eigen::Index n = 0; n < motion.velocity().size(); n += 3)
    ASSERT_LT((motion.velocity().segment<3>(n) - expected).norm(), 1e-9 * expected.norm());
}

TEST(Motion, DampedComesToRestWhereTheEquilibriumIs) {
  const Lattice lattice = bar(30);
  for (const Elasticity elasticity : {Elasticity::cauchy, Elasticity::corotational, Elasticity::neo_hookean}) {
    Scene still;
    still.elasticity = elasticity;
    still.gravity = earth;
    still.conditions = {held_end({-0.5, 0, 0}, {-1, 0, 0})};
    SolveReport static_report;
    const hexmesh::Result at_rest = solve_equilibrium(lattice, still, 1, static_report);
    Scene s = still;
    s.dynamics = moving(0.02, 3).dynamics;
    s.damping = {5, 0.005};
    SolveReport report;
    const hexmesh::Result moved = solve_dynamics(lattice, s, 1, report);
    EXPECT_TRUE(report.converged) << report.reason;
    double worst = 0;
    for (std::size_t n = 0; n < moved.displacement.size(); ++n)
      worst = std::max(worst, (moved.displacement[n] - at_rest.displacement[n]).norm());
    EXPECT_LT(worst, 1e-3);
    EXPECT_LT((report.conditions[0].reaction_n - static_report.conditions[0].reaction_n).norm(),
              1e-3 * static_report.conditions[0].reaction_n.norm());
  }
}

TEST(Motion, AStraightCellTakesItsRotationForTheStressOfAStrain) {
  // sigma = 2 mu dev(e) + kappa tr(e) of e = (cos w - 1) diag(1, 0, 1), across the axis of rotation.
  for (const double poisson : {0.0, 0.3, 0.4999}) {
    const Lattice lattice = bar(30, poisson);
    const Body body(lattice, 1, Elasticity::corotational);
    const CorotationalCells cells(*body.elastic);
    for (const double angle : {0.001, 0.02}) {
      const Mat3 r = Eigen::AngleAxisd(angle, Vec3::UnitY()).toRotationMatrix();
      const NodeVector u = sample(body.mesh, [&](const Vec3& p) { return Vec3(r * p - p); });
      const ElementModel& of = body.elastic->model(0);
      const Mat3 strain = (std::cos(angle) - 1) * Vec3(1, 0, 1).asDiagonal().toDenseMatrix();
      EXPECT_NEAR(cells.strain_of_rotations(u), -hooke_stress(of, strain)(0, 0) / (2 * of.shear),
                  1e-3 * cells.strain_of_rotations(u));
    }
  }
}

TEST(Motion, WithAutoMovesAsThatDoesInWhichAllCellsTurn) {
  for (const double poisson : {0.3, 0.45, 0.4999})
    for (const Integrator integrator : {Integrator::implicit_euler, Integrator::bdf2}) {
      const Lattice lattice = bar(30, poisson);
      Scene s = held_bar(moving(0.02, 1));
      s.dynamics->integrator = integrator;
      s.gravity = earth;
      Scene chosen = s;
      chosen.finds_strain = true;
      Motion all(lattice, s, 1), some(lattice, chosen, 1);
      double largest = 0, apart = 0;
      for (int n = 0; n < 50; ++n) {
        ASSERT_TRUE(all.step() && some.step());
        largest = std::max(largest, all.displacement().lpNorm<Eigen::Infinity>());
        apart = std::max(apart, (all.displacement() - some.displacement()).lpNorm<Eigen::Infinity>());
      }
      EXPECT_LT(apart, 0.01 * largest) << poisson;
    }
}

TEST(Motion, WithAutoCellsAreStraightWhereThatIsEnough) {
  const Lattice lattice = bar(30);
  Scene s = held_bar(moving(0.02, 1));
  s.gravity = 1e-3 * earth;
  Scene chosen = s;
  chosen.finds_strain = true;
  Motion all(lattice, s, 1), none(lattice, chosen, 1);
  for (int n = 0; n < 20; ++n) ASSERT_TRUE(all.step() && none.step());
  std::vector<Effect> effects = list_effects(chosen);
  none.explain(effects);
  EXPECT_TRUE(std::none_of(effects.begin(), effects.end(),
                           [](const Effect& e) { return e.kind == EffectKind::rotation && e.active; }));
  EXPECT_LT((all.displacement() - none.displacement()).lpNorm<Eigen::Infinity>(),
            1e-3 * all.displacement().lpNorm<Eigen::Infinity>());
}

TEST(Motion, WithAutoTheEnergyNeverGrowsWithoutWork) {
  const Lattice lattice = bar(30);
  Scene s = held_bar(moving(0.001, 1));
  s.finds_strain = true;
  Motion motion(lattice, s, 1);
  motion.set_state(NodeVector::Zero(motion.velocity().size()),
                   sample(motion.mesh(), [](const Vec3& p) { return Vec3(0, 0, 1.5 * p[0] * p[0]); }));
  expect_energy_never_grows(motion, 300);
}

TEST(Motion, ABallThatIsFastIsTakenInPartsOfItsRadius) {
  const Lattice lattice = bar(30);
  Scene s = held_bar(moving(0.02, 1));
  Contact ball;
  ball.name = "ball";
  ball.obstacle = Ball{{12, 3, 16}, 8};
  ball.stiffness = 0.5;
  ball.history = History{{{0, Vec3::Zero()}, {0.02, Vec3(0, 0, -10)}}};
  s.contacts = {ball};
  Motion motion(lattice, s, 1);
  ASSERT_TRUE(motion.step()) << motion.reason();
  EXPECT_GE(motion.counts().substeps, 8);  // 10 mm, 2 mm at a time at most
  EXPECT_GT(motion.energies().contact, 0);
  EXPECT_EQ(motion.ball_inside(), nullptr);
}

TEST(Motion, TheStartIsHeldAgainstTheConditions) {
  const Lattice lattice = bar(30);
  Scene s = held_bar(moving(0.02, 1));
  s.conditions[0].history = History{{{0, Vec3(0, 0, 7)}, {1, Vec3(0, 0, 8)}}};
  const std::vector<std::string> warnings = Motion(lattice, s, 1).check();
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("condition 'end' (test) puts points 7 mm from where the start has them"),
            std::string::npos);
}

TEST(Motion, AMovedSupportDoesTheWorkThatTheBodyGets) {
  // Pushed from rest to a constant velocity, without gravity: in the end all energy is kinetic, and was given.
  const Lattice lattice = bar(300);
  Scene s = held_bar(moving(0.002, 1));
  s.damping.stiffness_s = 0.01;
  s.conditions[0].history = History{{{0, Vec3::Zero()}, {1, Vec3(0, 0, 500)}}};
  Motion motion(lattice, s, 1);
  for (int n = 0; n < 500; ++n) ASSERT_TRUE(motion.step()) << motion.reason();
  const double mass = 24 * 6 * 6 * 1e-9;  // tonne
  EXPECT_NEAR(motion.energies().kinetic, mass * 500 * 500 / 2, 1e-6 * motion.energies().kinetic);
  EXPECT_GE(motion.work() + motion.work_uncertainty(), motion.energies().total());
  // The impulse times the velocity, found another way: the support goes at 500 mm/s, the body gains mass * 500.
  EXPECT_NEAR(motion.work(), mass * 500 * 500, 0.02 * mass * 500 * 500);
  EXPECT_LT((motion.momentum() - Vec3(0, 0, mass * 500)).norm(), 1e-6 * mass * 500);
}

TEST(Motion, AStepThatFailsIsHalved) {
  // A neo-Hookean bar whose end is pushed through most of it at once: that has no energy, parts of it do.
  const Lattice lattice = box({12, 6, 6}, {1, 1, 1}, 30, 0.3);
  Scene s = held_bar(moving(0.02, 1));
  s.elasticity = Elasticity::neo_hookean;
  Condition push = held_end({11.5, 0, 0}, {1, 0, 0});
  push.name = "push";
  push.history = History{{{0, Vec3::Zero()}, {0.02, Vec3(-9, 0, 0)}}};
  s.conditions.push_back(push);
  Motion motion(lattice, s, 0);
  ASSERT_TRUE(motion.step()) << motion.reason();
  EXPECT_GT(motion.counts().failed, 0);
  EXPECT_GT(motion.counts().substeps, 1);
  EXPECT_NEAR(motion.time(), 0.02, 1e-15);
}

TEST(Motion, WithoutMassIsRefused) {
  hexmesh::LabelVolume volume = make_volume({2, 2, 2}, {1, 1, 1}, [](const Index3&) { return 1; });
  const Lattice lattice =
      hexmesh::build_lattice(volume, {{volume.segments[0], hexmesh::material_from_units(10, 0.3, 0), 0, ""}});
  EXPECT_THROW(Motion(lattice, moving(0.1, 1), 0), hexmesh::Error);
}

TEST(Equilibrium, AWholeTurnIsNoContradiction) {
  const Lattice lattice = bar(30);
  Scene s;
  s.conditions = {held_end({-0.5, 0, 0}, {-1, 0, 0})};
  s.conditions[0].turn = Turn{Vec3::UnitX(), 2 * std::numbers::pi, {5, 5, 5}};
  SolveReport report;
  const hexmesh::Result result = solve_equilibrium(lattice, s, 1, report);
  ASSERT_TRUE(report.converged) << report.reason;
  for (const Vec3& u : result.displacement) EXPECT_LT(u.norm(), 1e-6);
}

TEST(Equilibrium, AnEndThatIsTurnedTurnsTheBodyWithIt) {
  const Lattice lattice = bar(30);
  Scene s;
  s.conditions = {held_end({-0.5, 0, 0}, {-1, 0, 0})};
  s.conditions[0].turn = Turn{Vec3(1, 2, 3).normalized(), 2 * std::numbers::pi / 3, {5, 5, 5}};
  SolveReport report;
  const hexmesh::Result result = solve_equilibrium(lattice, s, 1, report);
  ASSERT_TRUE(report.converged) << report.reason;
  const Mat3 r = Eigen::AngleAxisd(s.conditions[0].turn->radians, s.conditions[0].turn->axis).toRotationMatrix();
  const Vec3 about = s.conditions[0].turn->about;
  for (std::size_t n = 0; n < result.nodes.size(); ++n)
    EXPECT_LT((result.displacement[n] - (r * (result.nodes[n] - about) + about - result.nodes[n])).norm(), 1e-6);
}

}  // namespace test_dynamics
