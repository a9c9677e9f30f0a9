// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "constraints/constraints.h"
#include "hexmesh/lattice/locator.h"
#include "support/bodies.h"

namespace test_constraints {

using namespace hexsolver;
using namespace testing_support;

/// Exposed faces with x below a bound, moved by a rigid motion: what a patch of a scene becomes.
std::vector<ConstraintPoint> face_patch(const Lattice& lattice, int level, double below,
                                        const std::function<Vec3(const Vec3&)>& field) {
  const hexmesh::Level& l = lattice.levels[static_cast<std::size_t>(level)];
  const hexmesh::CellLocator locator(lattice.voxels, l.voxels_per_cell, l.cells);
  std::vector<ConstraintPoint> points;
  for (const auto& face : hexmesh::exposed_faces(lattice)) {
    const Vec3 p = lattice.voxels.position(hexmesh::face_index(face));
    if (p[0] >= below) continue;
    const auto e = locator.in_cell_of_voxel(face.voxel, hexmesh::face_index(face));
    points.push_back({0, e.cell, hexmesh::shape_functions(e.local), field(p)});
  }
  return points;
}

Vec3 tilt(const Vec3& p) { return Vec3(0.1, -0.2, 0.3).cross(p) + Vec3(1, 2, 3); }

/// A plate whose face patch is beyond the size that is decomposed densely.
Lattice plate() { return box({2, 40, 40}, {1, 1, 1}); }

class PatchSize : public testing::TestWithParam<bool> {
protected:
  const Lattice lattice = GetParam() ? plate() : bitten_ball({1, 1, 1});
  const Body body{lattice, GetParam() ? 0 : 1, Elasticity::cauchy};
  const Constraints constraints{body.mesh, face_patch(lattice, GetParam() ? 0 : 1, GetParam() ? 0 : 15, tilt)};
};

TEST_P(PatchSize, ProjectionIsOrthogonalAndIdempotent) {
  const NodeVector v = noise(body.mesh.num_dofs(), 1, 1), w = noise(body.mesh.num_dofs(), 1, 2);
  NodeVector pv = v, pw = w;
  constraints.project(pv);
  constraints.project(pw);
  NodeVector ppv = pv;
  constraints.project(ppv);
  EXPECT_LT((ppv - pv).norm(), 1e-8 * v.norm());
  EXPECT_NEAR(pv.dot(w), v.dot(pw), 1e-8 * v.norm() * w.norm());
  EXPECT_LT(pv.norm(), v.norm());
}

TEST_P(PatchSize, ALiftHoldsInTheKeptDirections) {
  NodeVector u = noise(body.mesh.num_dofs(), 1, 3);
  u += constraints.lift(u);
  EXPECT_LT(constraints.violation(u), 1e-8);
}

TEST_P(PatchSize, ProjectionLeavesTheKeptDirectionsAlone) {
  NodeVector u = noise(body.mesh.num_dofs(), 1, 3);
  u += constraints.lift(u);
  NodeVector v = noise(body.mesh.num_dofs(), 1, 5);
  constraints.project(v);
  EXPECT_LT(constraints.violation(u + v), 1e-7);
}

TEST_P(PatchSize, ARigidMotionOfThePatchContradictsNothing) {
  for (const double miss : constraints.incompatibility()) EXPECT_LT(miss, 1e-6);
  EXPECT_LT(constraints.violation(sample(body.mesh, tilt)), 1e-6);
}

TEST_P(PatchSize, MultipliersReturnTheForcesOfTheKeptDirections) {
  // Any H^T lambda that the kept directions can carry comes back with the same resultant.
  NodeVector r = noise(body.mesh.num_dofs(), 1, 6);
  NodeVector free = r;
  constraints.project(free);
  r -= free;
  const std::vector<Vec3> lambda = constraints.multipliers(r);
  NodeVector back = NodeVector::Zero(r.size());
  for (std::size_t p = 0; p < lambda.size(); ++p) {
    const ConstraintPoint& point = constraints.held()[p];
    for (int a = 0; a < 8; ++a)
      back.segment<3>(
          3 *
          Eigen::Index{body.mesh.cell_nodes()[static_cast<std::size_t>(point.cell)][static_cast<std::size_t>(a)]}) +=
          point.weights[a] * lambda[p];
  }
  EXPECT_LT((back - r).norm(), 1e-6 * r.norm());
}

INSTANTIATE_TEST_SUITE_P(SmallAndLarge, PatchSize, testing::Bool());

TEST(Constraints, DuplicatePointsCountOnce) {
  const Lattice lattice = bitten_ball({1, 1, 1});
  const Body body(lattice, 1, Elasticity::cauchy);
  std::vector<ConstraintPoint> points = face_patch(lattice, 1, 14, tilt);
  const Constraints once(body.mesh, points);
  const std::size_t count = points.size();
  for (std::size_t p = 0; p < count; ++p) points.push_back(points[p]);
  const Constraints twice(body.mesh, points);
  EXPECT_EQ(once.num_kept(), twice.num_kept());
  NodeVector a = noise(body.mesh.num_dofs(), 1, 1), b = a;
  once.project(a);
  twice.project(b);
  EXPECT_LT((a - b).norm(), 1e-10 * a.norm());
}

TEST(Constraints, ContradictingPointsAreMeasured) {
  const Lattice lattice = box({2, 2, 2}, {1, 1, 1});
  const Body body(lattice, 0, Elasticity::cauchy);
  auto points = face_patch(lattice, 0, 0, [](const Vec3&) { return Vec3::Zero(); });
  ConstraintPoint pulled = points.front();
  pulled.value = {2, 0, 0};
  points.push_back(pulled);
  const std::vector<double> miss = Constraints(body.mesh, points).incompatibility();
  EXPECT_NEAR(miss.front(), 1, 1e-6);
  EXPECT_NEAR(miss.back(), 1, 1e-6);
}

TEST(Constraints, OnlyTheChosenAxesAreHeld) {
  const Lattice lattice = box({2, 2, 2}, {1, 1, 1});
  const Body body(lattice, 0, Elasticity::cauchy);
  auto points = face_patch(lattice, 0, 0, [](const Vec3&) { return Vec3(1, 1, 1); });
  for (ConstraintPoint& p : points) p.axes = {false, false, true};
  const NodeVector d = Constraints(body.mesh, points).lift(NodeVector::Zero(81));
  EXPECT_EQ(d[0], 0);
  EXPECT_GT(d[2], 0.1);
}

TEST(SlidingSupport, TakesUpAUniformPressureOnPartlyFilledCells) {
  const Lattice lattice = bitten_ball({1, 1, 1});
  const Body body(lattice, 1, Elasticity::cauchy);
  std::vector<ConstraintPoint> points = face_patch(lattice, 1, 15, tilt);
  for (ConstraintPoint& p : points) p.axes = {true, false, false};
  const Constraints sliding(body.mesh, points);
  // Forces that are the same on all points, and all that H^T makes of them.
  NodeVector pressure = NodeVector::Zero(static_cast<Eigen::Index>(body.mesh.num_dofs()));
  for (const ConstraintPoint& p : points) {
    CellVector forces = CellVector::Zero();
    for (int a = 0; a < 8; ++a) forces[3 * a] = p.weights[a];
    body.mesh.scatter_add(static_cast<std::size_t>(p.cell), forces, pressure);
  }
  NodeVector rest = pressure;
  sliding.project(rest);
  EXPECT_LT(rest.norm(), 1e-8 * pressure.norm());
  FloatNodeVector single_rest = pressure.cast<float>();
  sliding.project(single_rest);
  EXPECT_LT(single_rest.norm(), 1e-6 * pressure.norm());  // 2^-24 times some ten
  double sum = 0;
  for (const Vec3& force : sliding.multipliers(pressure)) sum += force[0];
  EXPECT_NEAR(sum, static_cast<double>(points.size()), 1e-8 * static_cast<double>(points.size()));
  // On average the points are where they should be.
  const NodeVector u = sliding.lift(NodeVector::Zero(pressure.size()));
  double miss = 0;
  for (const ConstraintPoint& p : points) miss += p.value[0] - sliding.displacement(p, u)[0];
  EXPECT_NEAR(miss / static_cast<double>(points.size()), 0, 1e-8);
}

}  // namespace test_constraints
