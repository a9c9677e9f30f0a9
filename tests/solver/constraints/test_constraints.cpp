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
std::vector<ConstraintPoint> face_patch(const MeshCells& cells, double below,
                                        const std::function<Vec3(const Vec3&)>& field) {
  const Lattice& lattice = cells.lattice();
  const Mesh mesh = cells.make_mesh();
  std::vector<ConstraintPoint> points;
  for (const auto& face : hexmesh::exposed_faces(lattice)) {
    const Vec3 index = hexmesh::face_index(face), p = lattice.voxels.position(index);
    if (p[0] >= below) continue;
    const std::int32_t cell = cells.cell_of_voxel(face.voxel);
    const auto c = static_cast<std::size_t>(cell);
    Vec3 local;
    for (Eigen::Index d = 0; d < 3; ++d)
      local[d] = (index[d] + 0.5) / cells.lattice_level(c).voxels_per_cell[static_cast<std::size_t>(d)] -
                 mesh.cells()[c][static_cast<std::size_t>(d)];
    points.push_back({0, cell, hexmesh::shape_functions(local), field(p)});
  }
  return points;
}

std::vector<ConstraintPoint> face_patch(const Lattice& lattice, int level, double below,
                                        const std::function<Vec3(const Vec3&)>& field) {
  return face_patch(MeshCells(lattice, level), below, field);
}

Vec3 tilt(const Vec3& p) { return Vec3(0.1, -0.2, 0.3).cross(p) + Vec3(1, 2, 3); }

/// A plate whose face patch is beyond the size that is decomposed densely.
Lattice plate() { return box({2, 50, 50}, {1, 1, 1}); }

/// A patch: of cells alike or graded, of few nodes or many.
struct Patch {
  const char* name;
  bool is_large, is_graded;
  /// Which axes it holds; some only, and a translation: a uniform pressure has its support (see Constraints).
  std::array<bool, 3> axes = {true, true, true};
};
void PrintTo(const Patch& p, std::ostream* out) { *out << p.name; }

class PatchSize : public testing::TestWithParam<Patch> {
protected:
  MeshCells cells_of_patch() const {
    if (!GetParam().is_graded) return {lattice, GetParam().is_large ? 0 : 1};
    return {lattice, 0, 2, [](int level, const Index3& c) { return (c[0] + 2 * c[1] + 3 * c[2] + level) % 5 > 0; }};
  }
  Vec3 motion(const Vec3& p) const { return GetParam().axes[0] ? tilt(p) : Vec3(1, 2, 3); }
  std::vector<ConstraintPoint> points() const {
    std::vector<ConstraintPoint> out =
        face_patch(cells, GetParam().is_large ? 0 : 15, [this](const Vec3& p) { return motion(p); });
    for (ConstraintPoint& p : out) p.axes = GetParam().axes;
    return out;
  }
  const Lattice lattice = GetParam().is_large ? plate() : bitten_ball({1, 1, 1});
  const MeshCells cells = cells_of_patch();
  const Body body{cells, Elasticity::cauchy};
  const Constraints constraints{body.mesh, points()};
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

TEST_P(PatchSize, LargePatchesHoldNodes) {
  EXPECT_EQ(constraints.held().size() == constraints.points().size(), !GetParam().is_large);
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
  EXPECT_LT(constraints.violation(sample(body.mesh, [this](const Vec3& p) { return motion(p); })), 1e-6);
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
    for (std::size_t a = 0; a < 8; ++a)
      body.mesh.for_each_free(static_cast<std::size_t>(point.cell), a, [&](std::int32_t n, double weight) {
        back.segment<3>(3 * Eigen::Index{n}) += weight * point.weights[static_cast<Eigen::Index>(a)] * lambda[p];
      });
  }
  EXPECT_LT((back - r).norm(), 1e-6 * r.norm());
}

constexpr std::array<bool, 3> all_axes = {true, true, true}, without_x = {false, true, true};
INSTANTIATE_TEST_SUITE_P(SmallAndLarge, PatchSize,
                         testing::Values(Patch{"few nodes", false, false, all_axes},
                                         Patch{"many nodes", true, false, all_axes},
                                         Patch{"few nodes that slide", false, false, without_x},
                                         Patch{"few nodes, graded", false, true, all_axes},
                                         Patch{"many nodes, graded", true, true, all_axes},
                                         Patch{"few nodes that slide, graded", false, true, without_x}));

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
