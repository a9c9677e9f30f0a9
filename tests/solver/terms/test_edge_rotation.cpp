// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "core/rotation.h"
#include "solver/terms/large_deformation.h"
#include "terms/edge_rotation.h"

namespace test_edge_rotation {

using namespace hexsolver;
using namespace testing_support;

TEST(EdgeRotatedCells, ForcesAreTheLinearOnesInTheFrameOfTheEdges) {
  // A turned and slightly strained body: R K R^T (x - R X), R the rotation of the edges.
  const Lattice lattice = bitten_ball({1, 1, 2.5}, {0, 1, 0}, random_rotation(13));
  Body turning(lattice, 1, Elasticity::corotational, Volumetric::mean, Rotation::edges);
  const Body linear(lattice, 1, Elasticity::cauchy);
  EXPECT_FALSE(turning.potential.is_conservative());
  const Mat3 r = random_rotation(17);
  Mat3 upper;  // keeps the first edge and the plane of the first two: Gram-Schmidt gives R back
  upper << 1.02, 0.01, -0.02, 0, 0.97, 0.03, 0, 0, 1.01;
  const Mat3 axes = lattice.voxels.direction();
  const Mat3 strained = axes * upper * axes.transpose();
  const NodeVector moved = sample(turning.mesh, [&](const Vec3& x) -> Vec3 { return r * strained * x - x; });
  const NodeVector stretched = sample(turning.mesh, [&](const Vec3& x) -> Vec3 { return strained * x - x; });
  NodeVector g, expected, magnitude;
  linear.potential.gradient(stretched, expected, magnitude);
  turning.potential.gradient(moved, g, magnitude);
  for (std::size_t n = 0; n < turning.mesh.num_nodes(); ++n) {
    const auto at = 3 * static_cast<Eigen::Index>(n);
    EXPECT_LT((g.segment<3>(at) - r * expected.segment<3>(at)).norm(), 1e-11 * magnitude.norm());
  }
  EXPECT_NEAR(turning.potential.energy(moved), linear.potential.energy(stretched),
              1e-10 * linear.potential.energy(stretched));
}

TEST(EdgeRotatedCells, CellHessiansAddUpToTheOperator) {
  Body body(bitten_ball({1, 1, 1}), 1, Elasticity::corotational, Volumetric::mean, Rotation::edges);
  const NodeVector u = large_deformation(body.mesh, 0.05), direction = noise(body.mesh.num_dofs(), 1, 33);
  body.potential.linearize(u, Hessian::exact);
  NodeVector applied, added = NodeVector::Zero(direction.size());
  body.potential.apply(direction, applied);
  for (std::size_t c = 0; c < body.mesh.num_cells(); ++c)
    body.mesh.scatter_add(c, body.potential.cell_hessian(c) * body.mesh.gather(c, direction), added);
  EXPECT_LT((applied - added).norm(), 1e-11 * applied.norm());
  EXPECT_LT(error_of_single_precision(body.potential, direction), 1e-6);
}

}  // namespace test_edge_rotation
