// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "hexmesh/lattice/locator.h"
#include "hexmesh/warp/extension.h"
#include "support/bodies.h"

namespace test_extension {

using namespace hexmesh;
using namespace testing_support;

Result level_of(const Lattice& lattice, int level) {
  Result r = rest_state(lattice, level);
  r.displacement.assign(r.nodes.size(), Vec3::Zero());
  return r;
}

/// Part of a cell's material that each node sees.
std::vector<double> seen_by_nodes(const Lattice& lattice, const Result& r) {
  std::vector<double> out(r.nodes.size());
  const CellLocator locator(r.voxels, r.voxels_per_cell, r.cells);
  for (std::size_t n = 0; n < r.labels.size(); ++n) {
    if (r.labels[n] == 0) continue;
    const Index3 v = r.voxels.index(n);
    const Embedding e = locator.in_cell_of_voxel(v, Vec3(v[0], v[1], v[2]));
    const NodeWeights w = shape_functions(e.local);
    for (std::size_t a = 0; a < 8; ++a) out[r.cell_nodes[e.cell][a]] += w[static_cast<Eigen::Index>(a)];
  }
  for (double& x : out) x /= static_cast<double>(count_in(r.voxels_per_cell));
  EXPECT_GT(lattice.levels.size(), 1U);
  return out;
}

TEST(NodeExtension, ContinuesAffineFieldsExactlyWhateverSeldomSeenNodesHave) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    const Lattice lattice = bitten_ball({1, 1.3, 0.8}, {1, 2, 3}, random_rotation(seed));
    for (const int level : {1, 2, 3}) {
      Result r = level_of(lattice, level);
      const Mat3 gradient = Mat3::Random();
      const auto affine = [&](const Vec3& x) -> Vec3 { return gradient * x + Vec3(1, 2, 3); };
      for (std::size_t n = 0; n < r.nodes.size(); ++n) r.displacement[n] = affine(r.nodes[n]);
      const NodeExtension extension(r);
      double size = 0, off = 0;
      for (const std::vector<Vec3> field = extension.extended(r.displacement); const Vec3& x : r.nodes) {
        const std::size_t n = static_cast<std::size_t>(&x - r.nodes.data());
        off = std::max(off, (field[n] - affine(x)).norm());
        size = std::max(size, affine(x).norm());
      }
      EXPECT_LT(off, 1e-9 * size) << level;
      EXPECT_GT(extension.num_nodes(), 0U) << level;
    }
  }
}

TEST(NodeExtension, SpikesOfNearlyEmptyCellsGoAndAllElseStays) {
  const Lattice lattice = bitten_ball({1, 1, 1}, {2, 1, 3});
  Result r = level_of(lattice, 2);
  const std::vector<double> seen = seen_by_nodes(lattice, r);
  std::vector<Vec3> smooth(r.nodes.size());
  for (std::size_t n = 0; n < r.nodes.size(); ++n) {
    smooth[n] = Vec3(0.1 * r.nodes[n][1], std::sin(0.05 * r.nodes[n][0]), 0);
    r.displacement[n] = smooth[n];
    if (seen[n] < 0.005) r.displacement[n] += Vec3(50, -80, 30);  // centimetres, as solved
  }
  const NodeExtension extension(r);
  const std::vector<Vec3> field = extension.extended(r.displacement);
  for (std::size_t n = 0; n < field.size(); ++n) {
    if (seen[n] >= 0.05) {
      EXPECT_EQ(field[n], r.displacement[n]);
    }
    EXPECT_LT((field[n] - smooth[n]).norm(), 3) << "of 99 mm";
  }
}

TEST(NodeExtension, FullCellsNeedNone) {
  EXPECT_TRUE(NodeExtension(level_of(box({8, 8, 8}, {1, 1, 1}), 1)).is_empty());
  EXPECT_TRUE(NodeExtension(level_of(bitten_ball({1, 1, 1}), 0)).is_empty()) << "cells that are voxels are full";
}

TEST(NodeExtension, SliversTakeTheMeanAround) {
  const Lattice lattice = bitten_ball({1, 1, 1}, {2, 1, 3});
  const Result r = level_of(lattice, 2);
  const std::vector<double>& fill = r.cell_fields.at("fill");
  std::vector<double> stress(fill.size(), 3);
  std::size_t slivers = 0;
  for (std::size_t c = 0; c < fill.size(); ++c)
    if (fill[c] < 0.05) {
      stress[c] = 100;
      ++slivers;
    }
  ASSERT_GT(slivers, 0U);
  const std::vector<double> shown = NodeExtension(r).without_slivers(stress);
  for (std::size_t c = 0; c < fill.size(); ++c) {
    if (fill[c] >= 0.1) {
      EXPECT_EQ(shown[c], 3);
    }
    EXPECT_LT(shown[c], 20) << "the mean by volume";
  }
}

}  // namespace test_extension
