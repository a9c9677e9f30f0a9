// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "dynamics/backward_difference.h"
#include "hexsolver/dynamics/motion.h"
#include "support/bodies.h"

namespace test_bdf2 {

using namespace hexsolver;
using namespace testing_support;

const Vec3 earth(0, 0, -9810);  // mm/s^2

Scene moving(Integrator integrator, double step, Elasticity elasticity) {
  Scene scene;
  scene.elasticity = elasticity;
  scene.tolerance = 1e-11;
  Dynamics d;
  d.step = step;
  d.duration = 1;
  d.integrator = integrator;
  scene.dynamics = d;
  return scene;
}

Lattice bar(double young_kpa) { return box({24, 6, 6}, {1, 1, 1}, young_kpa, 0.3); }

/// By which power of the step the displacements err after `seconds`, from two steps and one 16 times as fine. The start
/// is what steps of implicit Euler leave of a motion: little that is too fast for the steps.
double order_of(const Lattice& lattice, Scene scene, double settling_step, double step, double seconds) {
  Scene smooth = scene;
  smooth.dynamics->integrator = Integrator::implicit_euler;
  smooth.dynamics->step = settling_step;
  Motion before(lattice, smooth, 1);
  for (int n = 0; n < 20; ++n) EXPECT_TRUE(before.step()) << before.reason();
  const auto end_of = [&](double h) {
    scene.dynamics->step = h;
    Motion motion(lattice, scene, 1);
    motion.set_state(before.displacement(), before.velocity());
    while (motion.time() < seconds - 1e-9) EXPECT_TRUE(motion.step()) << motion.reason();
    EXPECT_EQ(motion.counts().failed, 0);
    return motion.displacement();
  };
  const NodeVector exact = end_of(step / 16);
  return std::log2((end_of(step) - exact).norm() / (end_of(step / 2) - exact).norm());
}

/// sum_n m_n x_n x v_n of a full box [N mm s].
Vec3 angular_momentum(const Lattice& lattice, const Motion& motion) {
  const double share = lattice.materials[0].material.density * lattice.cell_size(1).prod() / 8;
  Vec3 sum = Vec3::Zero();
  for (const hexmesh::CellNodes& nodes : motion.cell_nodes())
    for (const std::int32_t node : nodes) {
      const Eigen::Index at = 3 * Eigen::Index{node};
      const Vec3 x = motion.mesh().position(static_cast<std::size_t>(node)) + motion.displacement().segment<3>(at);
      sum += share * x.cross(Vec3(motion.velocity().segment<3>(at)));
    }
  return sum;
}

TEST(BackwardDifference, IsExactForSquaresOfTimeAndStepsOfAnyLength) {
  const auto u = [](double t) { return NodeVector::Constant(3, 2 + 3 * t - 5 * t * t); };
  const auto v = [](double t) { return NodeVector::Constant(3, 3 - 10 * t); };
  for (const double h : {0.1, 0.05, 0.2}) {
    BackwardDifference d;
    EXPECT_FALSE(d.has_past());
    d.begin_euler(h);
    EXPECT_EQ(d.length(), h);
    EXPECT_EQ(d.u(u(0.3)), u(0.3));
    d.remember(u(0.3), v(0.3), 0.1);
    d.begin_bdf2(u(0.4), v(0.4), h);
    EXPECT_NEAR(((u(0.4 + h) - d.u(u(0.4))) / d.length())[0], v(0.4 + h)[0], 1e-12);
    EXPECT_NEAR(((v(0.4 + h) - d.v(v(0.4))) / d.length())[0], -10, 1e-12);
    EXPECT_NEAR(d.ahead(u(0.4))[0], u(0.4 + h)[0], 5 * h * (h + 0.1) + 1e-12);  // of first order: straight on
    // Without a past: u'' = -10 by two stages, each of implicit Euler's form.
    const double part = BackwardDifference::first_stage(h);
    const NodeVector stage_v = v(0.4).array() - 10 * part;
    const NodeVector stage_u = u(0.4) + part * stage_v;
    d.begin_second_stage(u(0.4), v(0.4), stage_u, stage_v, h);
    const NodeVector end_v = d.v(v(0.4)).array() - 10 * d.length();
    EXPECT_NEAR(end_v[0], v(0.4 + h)[0], 1e-12);
    EXPECT_NEAR((d.u(u(0.4)) + d.length() * end_v)[0], u(0.4 + h)[0], 1e-12);
  }
}

TEST(BackwardDifference, TakesFromASwingWhatTheManualSays) {
  struct Row {
    int steps;
    double euler, bdf2;  ///< of the energy, in a period; bdf2 after the first ones
  };
  for (const Row& row : {Row{20, 0.85, 0.075}, Row{100, 0.33, 8e-4}, Row{1000, 0.039, 8e-7}}) {
    const double h = 2 * std::numbers::pi / row.steps;
    for (const bool is_bdf2 : {false, true}) {
      BackwardDifference d;
      NodeVector u = NodeVector::Constant(1, 1), v = NodeVector::Zero(1);
      const auto swing = [&](int periods) {
        for (int n = 0; n < periods * row.steps; ++n) {
          if (d.has_past())
            d.begin_bdf2(u, v, h);
          else
            d.begin_euler(h);
          const NodeVector end = (d.u(u) + d.length() * d.v(v)) / (1 + d.length() * d.length());
          const NodeVector velocity = (end - d.u(u)) / d.length();
          if (is_bdf2) d.remember(u, v, h);
          u = end;
          v = velocity;
        }
        return u[0] * u[0] + v[0] * v[0];
      };
      const double before = swing(2);
      const double expected = is_bdf2 ? row.bdf2 : row.euler;
      EXPECT_NEAR(1 - swing(1) / before, expected, 0.04 * expected) << row.steps;
    }
  }
}

TEST(Bdf2, ErrsByTheSquareOfTheStepWhereABarSwings) {
  // Held at one end, under its weight, some 30 Hz.
  struct Case {
    Elasticity elasticity;
    double damping;
  };
  for (const Case& c :
       {Case{Elasticity::cauchy, 0}, Case{Elasticity::corotational, 2e-3}, Case{Elasticity::neo_hookean, 0}}) {
    Scene scene = moving(Integrator::bdf2, 0, c.elasticity);
    scene.gravity = earth;
    scene.damping.stiffness_s = c.damping;
    Condition end;
    end.name = "end";
    end.selection.halfspace = HalfSpace{{-0.5, 0, 0}, {-1, 0, 0}};
    scene.conditions = {end};
    const double order = order_of(bar(300), scene, 5e-4, 2e-4, 0.01);
    EXPECT_GT(order, 1.9) << static_cast<int>(c.elasticity);
    EXPECT_LT(order, 2.1) << static_cast<int>(c.elasticity);
  }
}

TEST(Bdf2, ErrsByTheSquareOfTheStepWhereAPendulumSwings) {
  // A bar that hangs by one point of its end, from where it lies flat.
  Scene scene = moving(Integrator::bdf2, 0, Elasticity::corotational);
  scene.gravity = earth;
  Condition pivot;
  pivot.name = "pivot";
  pivot.selection.balls = {{Vec3(-0.5, 2.5, 2.5), 0}};
  scene.conditions = {pivot};
  const double order = order_of(bar(3e4), scene, 1e-3, 4e-3, 0.4);
  EXPECT_GT(order, 1.9);
  EXPECT_LT(order, 2.1);
}

TEST(Bdf2, LosesAHundredthOfTheAngularMomentumThatImplicitEulerLoses) {
  const Lattice lattice = bar(1000);
  const auto lost = [&](Integrator integrator) {
    Motion motion(lattice, moving(integrator, 0.01, Elasticity::corotational), 1);
    const Vec3 centre(11.5, 2.5, 2.5), turning(0, 0, 5.7);  // rad/s: implicit Euler loses 0.32 a second
    motion.set_state(NodeVector::Zero(motion.velocity().size()),
                     sample(motion.mesh(), [&](const Vec3& p) { return Vec3(turning.cross(p - centre)); }));
    const Vec3 before = angular_momentum(lattice, motion);
    for (int n = 0; n < 100; ++n) EXPECT_TRUE(motion.step()) << motion.reason();
    EXPECT_EQ(motion.counts().substeps, 100);
    EXPECT_EQ(motion.counts().failed, 0);
    return 1 - angular_momentum(lattice, motion).norm() / before.norm();
  };
  const double euler = lost(Integrator::implicit_euler), bdf2 = lost(Integrator::bdf2);
  EXPECT_NEAR(euler, 1 - 1 / std::sqrt(1 + 2 * 5.7 * 5.7 * 0.01), 0.01);  // d omega / dt = - omega^3 h
  EXPECT_LT(std::abs(bdf2), euler / 100);
  EXPECT_LT(std::abs(bdf2), 0.001);
}

TEST(Bdf2, BeginsAnewWhereATableBends) {
  // A support that moves evenly and stops: held points must not overshoot.
  const Lattice lattice = bar(300);
  Scene scene = moving(Integrator::bdf2, 0.002, Elasticity::corotational);
  Condition all;
  all.name = "all";
  all.selection.halfspace = HalfSpace{{-0.5, 0, 0}, {-1, 0, 0}};
  all.history = History{{{0, Vec3::Zero()}, {0.011, Vec3(0, 0, 1.1)}}};
  scene.conditions = {all};
  Motion motion(lattice, scene, 1);
  for (int n = 0; n < 20; ++n) {
    ASSERT_TRUE(motion.step()) << motion.reason();
    // Nodes of the end face, which the support moves: at 100 mm/s at most, and at rest after the second step of rest.
    double fastest = 0;
    for (std::size_t k = 0; k < motion.mesh().num_nodes(); ++k)
      if (motion.mesh().position(k)[0] < -0.4)
        fastest = std::max(fastest, motion.velocity().segment<3>(3 * static_cast<Eigen::Index>(k)).norm());
    EXPECT_LT(fastest, n >= 7 ? 1e-6 : 100 * (1 + 1e-6)) << "step " << n;
  }
}

}  // namespace test_bdf2
