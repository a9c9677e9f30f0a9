// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "hexsolver/equilibrium/equilibrium.h"
#include "support/bodies.h"
#include "support/solve.h"
#include "terms/loads.h"

namespace test_loads {

using namespace hexsolver;
using namespace testing_support;

constexpr double young = 0.1, density = 1e-9;  // MPa, tonne/mm^3
const Vec3 size(5, 6, 22);                     // mm; cells of levels 1 and 2 are partly filled
const double area = size[0] * size[1];

/// A bar along z from z = -1 on, without lateral contraction, so that one-dimensional closed forms hold exactly.
Lattice bar() { return box({5, 6, 11}, {1, 1, 2}, young * 1e3, 0); }

Selection slab(double z) {
  Selection s;
  s.box = hexmesh::Box{Vec3(0.01, 0.01, 10).asDiagonal(), Vec3(2, 2.5, z)};  // 0.1 mm to both sides
  return s;
}

Scene held_at_the_bottom(Elasticity elasticity) {
  Scene scene;
  scene.elasticity = elasticity;
  scene.tolerance = 1e-10;
  Condition c;
  c.name = "bottom";
  c.selection = slab(-1);
  c.selection.on = SurfacePoints::nodes;  // faces leave the weakest directions to least squares
  scene.conditions = {c};
  return scene;
}

Force at_the_top() {
  Force f;
  f.name = "top";
  f.selection = slab(size[2] - 1);
  return f;
}

struct Solved {
  SolveReport report;
  hexmesh::Result result;
};

Solved solve(const Scene& scene, const Lattice& lattice, int level) {
  SolveReport report;
  hexmesh::Result result = solve_equilibrium(lattice, scene, level, report);
  EXPECT_TRUE(report.converged) << report.reason;
  return {report, std::move(result)};
}

class Loads : public testing::TestWithParam<int> {};

TEST_P(Loads, AForceStretchesABarByFLOverEA) {
  const Lattice lattice = bar();
  Scene scene = held_at_the_bottom(Elasticity::cauchy);
  scene.forces = {at_the_top()};
  scene.forces[0].total = Vec3(0, 0, 0.05);
  const Solved pulled = solve(scene, lattice, GetParam());
  const double strain = 0.05 / (young * area);
  for (std::size_t n = 0; n < pulled.result.nodes.size(); ++n)
    EXPECT_NEAR(pulled.result.displacement[n][2], strain * (pulled.result.nodes[n][2] + 1), 1e-7);
  EXPECT_NEAR((pulled.report.conditions[0].reaction_n - Vec3(0, 0, -0.05)).norm(), 0, 1e-9);

  scene.forces[0].total.setZero();
  scene.forces[0].pressure = -0.05 / area;  // suction
  const Solved sucked = solve(scene, lattice, GetParam());
  for (std::size_t n = 0; n < sucked.result.nodes.size(); ++n)
    EXPECT_NEAR((sucked.result.displacement[n] - pulled.result.displacement[n]).norm(), 0, 1e-9);
  EXPECT_NEAR((sucked.report.forces[0].total_n - Vec3(0, 0, 0.05)).norm(), 0, 1e-12);
}

TEST_P(Loads, CorotationalBarsTurnedByHalfPullLikeStraightOnes) {
  // Pulled sideways and let go of by nothing else, the end goes where the force is balanced; the sum of all forces is
  // 0.
  const Lattice lattice = bar();
  Scene scene = held_at_the_bottom(Elasticity::corotational);
  scene.forces = {at_the_top()};
  scene.forces[0].total = Vec3(0.004, -0.003, 0.02);
  scene.gravity = Vec3(0, 9810, 0);
  const Solved s = solve(scene, lattice, GetParam());
  const Vec3 weight = s.report.forces[1].total_n;
  EXPECT_EQ(s.report.forces[1].name, "gravity");
  EXPECT_NEAR((weight - density * size.prod() * scene.gravity).norm(), 0, 1e-12);
  EXPECT_NEAR((s.report.conditions[0].reaction_n + weight + scene.forces[0].total).norm(), 0, 1e-8);
}

TEST_P(Loads, ABarUnderItsOwnWeightStretchesByRhoGL2Over2E) {
  const Lattice lattice = bar();
  Scene scene = held_at_the_bottom(Elasticity::cauchy);
  scene.gravity = Vec3(0, 0, 9810);
  const Solved s = solve(scene, lattice, GetParam());
  // The end face, as embedded; nodal values of 1-D linear elements are exact, between them they lie below by the
  // parabola rho g h^2 / 8 E at the most.
  const double expected = density * 9810 * size[2] * size[2] / (2 * young);
  const double h = lattice.cell_size(GetParam())[2];
  double end = 0;
  for (std::size_t n = 0; n < s.result.nodes.size(); ++n) end = std::max(end, s.result.displacement[n][2]);
  EXPECT_NEAR(end, expected, GetParam() == 0 ? 1e-7 : density * 9810 * h * h / (8 * young) + 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Levels, Loads, testing::Values(0, 1, 2));

/// What of it hangs in a cell that is partly filled is 9 times softer a level, and as much lighter.
TEST(Loads, ABarOfCondensedCellsStretchesLikeThePapers) {
  const Lattice lattice = bar();
  for (const int level : {1, 2}) {
    Scene scene = held_at_the_bottom(Elasticity::cauchy);
    scene.stiffness = Stiffness::condensed;
    scene.forces = {at_the_top()};
    scene.forces[0].total = Vec3(0, 0, 0.05);
    const Solved pulled = solve(scene, lattice, level);
    const double strain = 0.05 / (young * area);
    for (std::size_t n = 0; n < pulled.result.nodes.size(); ++n)
      EXPECT_NEAR(pulled.result.displacement[n][2], strain * (pulled.result.nodes[n][2] + 1), 1e-7);

    scene.forces.clear();
    scene.gravity = Vec3(0, 0, 9810);
    const Solved s = solve(scene, lattice, level);
    const Vec3 weight = s.report.forces[0].total_n;
    EXPECT_NEAR((weight - density * size.prod() * scene.gravity).norm(), 0, 1e-12);
    EXPECT_NEAR((s.report.conditions[0].reaction_n + weight).norm(), 0, 1e-8);
    const double expected = density * 9810 * size[2] * size[2] / (2 * young);
    const double end = displacement_inside(s.result, {{2, 2.5, 20.9}})[0][2];
    EXPECT_NEAR(end, expected, 0.04 * expected) << "level " << level;
  }
}

TEST(Loads, NothingIsBuiltForASceneWithout) {
  const Lattice lattice = bar();
  const Body body(lattice, 0, Elasticity::cauchy);
  Selector selector({lattice, 0}, body.mesh);
  EXPECT_TRUE(make_loads(Scene{}, {lattice, 0}, body.mesh, selector).empty());
}

}  // namespace test_loads
