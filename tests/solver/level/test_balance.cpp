// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "support/bodies.h"
#include "support/solve.h"

namespace test_balance {

using namespace hexsolver;
using namespace testing_support;

Selection beyond(const Vec3& point, const Vec3& normal) {
  Selection s;
  s.halfspace = HalfSpace{point, normal};
  return s;
}

Condition held(const std::string& name, const Vec3& point, const Vec3& normal, const Vec3& by = Vec3::Zero()) {
  Condition c;
  c.name = c.where = name;
  c.selection = beyond(point, normal);
  c.by = by;
  return c;
}

/// What acts adds up to nothing beside its largest parts.
void expect_balance(const SolveReport& report, double tolerance, double of_moments) {
  double force = 0, moment = 0;
  for (const BalanceReport::Row& row : report.balance.acting) {
    force = std::max(force, row.force_n.norm());
    moment = std::max(moment, row.moment_n_mm.norm());
  }
  const BalanceReport::Row sum = report.balance.sum();
  EXPECT_GT(force, 0);
  EXPECT_GT(moment, 0);
  EXPECT_LT(sum.force_n.norm(), tolerance * force);
  EXPECT_LT(sum.moment_n_mm.norm(), of_moments * moment);
}

/// Held at one end, under gravity, a force, a pressure and an obstacle; with a bite, so that cells are partly filled.
Lattice bitten_bar() {
  return one_material(
      {24, 8, 8}, {1, 1, 1.25}, [](const Index3& i) { return i[0] < 12 || i[1] + i[2] > 4; }, 30, 0.4);
}

Scene loaded_bar(Elasticity law) {
  Scene scene;
  scene.elasticity = law;
  if (law == Elasticity::green_lagrange) scene.volumetric = Volumetric::full;
  scene.conditions = {held("end", {0, 0, 0}, {-1, 0, 0})};
  scene.gravity = {0, 4000, -9810};
  Force force;
  force.name = force.where = "pull";
  force.selection = beyond({22.4, 0, 0}, {1, 0, 0});
  force.total = {1e-3, -2e-3, 5e-4};
  scene.forces = {force};
  force.name = force.where = "press";
  force.selection = beyond({0, 6.4, 0}, {0, 1, 0});
  force.pressure = 2e-6;
  force.total = Vec3::Zero();
  scene.forces.push_back(force);
  Contact table;
  table.name = table.where = "table";
  table.obstacle = HalfSpace{{0, 0, -0.9}, {0, 0, 1}};
  table.stiffness = 0.02;
  scene.contacts = {table};
  return scene;
}

const ConditionReport& condition(const SolveReport& report, std::size_t n) { return report.conditions.at(n); }

TEST(Balance, OfEverythingThatActsIsNothing) {
  const Lattice lattice = bitten_bar();
  for (const Elasticity law : {Elasticity::cauchy, Elasticity::corotational, Elasticity::neo_hookean,
                               Elasticity::stable_neo_hookean, Elasticity::green_lagrange})
    for (int level = 0; level < 2; ++level) {
      SCOPED_TRACE(testing::Message() << "law " << static_cast<int>(law) << " level " << level);
      SolveReport report;
      solve_equilibrium(lattice, loaded_bar(law), level, report);
      ASSERT_TRUE(report.converged) << report.reason;
      ASSERT_EQ(report.balance.acting.size(), 5U);
      EXPECT_EQ(report.balance.acting[0].name, "condition 'end'");
      EXPECT_EQ(report.balance.acting[1].name, "force 'pull'");
      EXPECT_EQ(report.balance.acting[3].name, "gravity");
      EXPECT_EQ(report.balance.acting[4].name, "contact 'table'");
      EXPECT_GT(report.balance.acting[4].force_n[2], 0) << "the table is touched";
      EXPECT_LT((report.balance.acting[4].force_n - report.contacts[0].force_n).norm(), 1e-12);
      EXPECT_EQ(report.balance.acting[3].moment_n_mm, report.forces[2].moment_n_mm);
      expect_balance(report, 1e-6, 1e-6);
    }
}

TEST(Balance, ACantileversSupportHasTheMomentOfItsLoad) {
  // A force across the end of a beam along x, small strain: its moment about the foot is length times force.
  const Lattice lattice = box({30, 4, 4}, {1, 1, 1});
  Scene scene;
  scene.elasticity = Elasticity::cauchy;
  scene.conditions = {held("foot", {-0.4, 0, 0}, {-1, 0, 0})};
  Force force;
  force.name = force.where = "tip";
  force.selection = beyond({29.4, 0, 0}, {1, 0, 0});
  force.total = {0, 0, -0.01};
  scene.forces = {force};
  SolveReport report;
  solve_equilibrium(lattice, scene, 0, report);
  ASSERT_TRUE(report.converged) << report.reason;
  EXPECT_LT((report.balance.about_mm - Vec3(14.5, 1.5, 1.5)).norm(), 1e-12);
  EXPECT_LT((condition(report, 0).reaction_n - Vec3(0, 0, 0.01)).norm(), 1e-9);
  // About the middle: that of the tip is (15, 0, 0) x (0, 0, -0.01), the support's is the opposite.
  EXPECT_LT((report.forces[0].moment_n_mm - Vec3(0, 0.15, 0)).norm(), 1e-9);
  EXPECT_LT((condition(report, 0).moment_n_mm - Vec3(0, -0.15, 0)).norm(), 1e-7);
}

TEST(Balance, SpringsOfIslandsAreInIt) {
  // A second part that nothing holds, under gravity.
  const Lattice lattice = one_material({12, 4, 4}, {1, 1, 1}, [](const Index3& i) { return i[0] < 5 || i[0] > 7; });
  Scene scene;
  scene.islands = Islands::hold;
  scene.gravity = {0, 0, -9810};
  scene.conditions = {held("end", {0, 0, 0}, {-1, 0, 0})};
  SolveReport report;
  solve_equilibrium(lattice, scene, 0, report);
  ASSERT_TRUE(report.converged) << report.reason;
  ASSERT_EQ(report.balance.acting.size(), 3U);
  EXPECT_EQ(report.balance.acting[1].name, "islands");
  EXPECT_LT((report.balance.acting[1].force_n - report.held_force_n).norm(), 1e-15);
  EXPECT_GT(report.held_force_n[2], 0);
  expect_balance(report, 1e-6, 1e-6);
}

TEST(Balance, InertiaAndDampingAreInThatOfAMotion) {
  const Lattice lattice = bitten_bar();
  for (const double damping : {0.0, 0.01}) {
    Scene scene = loaded_bar(Elasticity::corotational);
    scene.dynamics = Dynamics{.step = 0.01, .duration = 0.05};
    scene.damping = {5 * damping, damping};
    SolveReport report;
    solve_dynamics(lattice, scene, 1, report);
    ASSERT_TRUE(report.converged) << report.reason;
    const BalanceReport::Row* inertia = nullptr;
    for (const BalanceReport::Row& row : report.balance.acting)
      if (row.name == "inertia") inertia = &row;
    ASSERT_TRUE(inertia);
    EXPECT_GT(inertia->force_n.norm(), 1e-5);
    EXPECT_EQ(report.balance.acting.back().name, damping > 0 ? "damping" : "inertia");
    // What damps strain at the start of a step has a moment of second order in the turn of the step.
    expect_balance(report, 1e-6, damping > 0 ? 1e-2 : 1e-6);
  }
}

}  // namespace test_balance
