// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "hexmesh/lattice/locator.h"
#include "support/bodies.h"

namespace test_locator {

using namespace hexmesh;
using namespace testing_support;

TEST(Locator, EmbeddedPointsFollowALinearFieldExactly) {
  const Lattice lattice = bitten_ball({0.8, 0.8, 2.5}, {1, 0, 2}, random_rotation(2));
  Mat3 gradient;
  gradient << 0.1, -0.05, 0.02, 0.3, 0.2, -0.1, 0.07, 0.04, -0.15;
  for (int number = 0; number < 3; ++number) {
    const Level& level = lattice.levels[number];
    const Body body(lattice, number, hexsolver::Elasticity::cauchy);
    const CellLocator locator(lattice.voxels, level.voxels_per_cell, level.cells);
    for (const ExposedFace& face : exposed_faces(lattice)) {
      const Vec3 p = lattice.voxels.position(face_index(face));
      const Embedding e = locator.in_cell_of_voxel(face.voxel, face_index(face));
      ASSERT_GE(e.cell, 0);
      ASSERT_GE(e.local.minCoeff(), 0);
      ASSERT_LE(e.local.maxCoeff(), 1);
      const NodeWeights weights = shape_functions(e.local);
      Vec3 u = Vec3::Zero();
      for (int a = 0; a < 8; ++a)
        u += weights[a] * gradient * body.mesh.position(static_cast<std::size_t>(body.mesh.cell_nodes()[e.cell][a]));
      ASSERT_LT((u - gradient * p).norm(), 1e-9 * p.norm());
    }
  }
}

TEST(Locator, PointsJustOutsideTakeTheNearestCellAndFarOnesNone) {
  const Lattice lattice = box({4, 4, 4}, {1, 1, 1});
  const CellLocator locator(lattice.voxels, {1, 1, 1}, lattice.levels[0].cells);
  const Embedding near = locator.locate({-1.2, 1.4, 2});
  ASSERT_GE(near.cell, 0);
  EXPECT_EQ(lattice.levels[0].cells[near.cell], (Index3{0, 1, 2}));
  EXPECT_NEAR(near.local[0], -0.7, 1e-12);
  EXPECT_EQ(locator.locate({-9, 0, 0}).cell, 0);
  EXPECT_EQ(locator.locate({-10.6, 0, 0}).cell, -1);
  EXPECT_EQ(locator.locate({1e300, 0, 0}).cell, -1);
}

TEST(Locator, LooksNoFurtherThanTheBox) {
  // 10 mm are a hundred million voxels here: shells around the point must end where the box does.
  const Lattice lattice = box({4, 4, 4}, {1e-7, 1e-7, 1e-7});
  const CellLocator locator(lattice.voxels, {1, 1, 1}, lattice.levels[0].cells);
  EXPECT_EQ(locator.locate({-3, 0, 0}).cell, 0);
  EXPECT_EQ(locator.locate({900000, 900000, 900000}).cell, 63);
  EXPECT_EQ(locator.locate({3, 3, 7}).cell, 63);
}

}  // namespace test_locator
