// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "hexmesh/core/index.h"
#include "hexmesh/lattice/nodes.h"

namespace test_index {

using namespace hexmesh;

TEST(Index, OffsetsCountThroughABoxWithIFastest) {
  const Index3 extent = {3, 4, 5};
  std::vector<Index3> indices;
  for (std::int32_t k = 0; k < 5; ++k)
    for (std::int32_t j = 0; j < 4; ++j)
      for (std::int32_t i = 0; i < 3; ++i) indices.push_back({i, j, k});
  ASSERT_EQ(count_in(extent), indices.size());
  for (std::size_t n = 0; n < indices.size(); ++n) {
    EXPECT_EQ(offset_in(extent, indices[n]), n);
    EXPECT_EQ(index_in(extent, n), indices[n]);
  }
  EXPECT_TRUE(std::is_sorted(indices.begin(), indices.end(), i_fastest));
  EXPECT_FALSE(i_fastest({1, 2, 3}, {1, 2, 3}));
}

TEST(Index, OffsetsOfLargeBoxesDoNotOverflow) {
  const Index3 extent = {65536, 65536, 3};
  EXPECT_EQ(count_in(extent), 12884901888U);
  EXPECT_EQ(offset_in(extent, {65535, 65535, 2}), 12884901887U);
  EXPECT_EQ(index_in(extent, 12884901887U), (Index3{65535, 65535, 2}));
}

TEST(Index, StridesAreTheOffsetsOfNeighbours) {
  const Index3 extent = {3, 4, 5}, ijk = {1, 2, 3};
  for (std::size_t d = 0; d < 3; ++d) {
    Index3 next = ijk;
    ++next[d];
    EXPECT_EQ(offset_in(extent, next) - offset_in(extent, ijk), strides_in(extent)[d]);
  }
}

TEST(Index, OnlyIndicesFromZeroToTheExtentAreInABox) {
  EXPECT_TRUE(is_in({3, 4, 5}, {0, 0, 0}));
  EXPECT_TRUE(is_in({3, 4, 5}, {2, 3, 4}));
  EXPECT_FALSE(is_in({3, 4, 5}, {3, 0, 0}));
  EXPECT_FALSE(is_in({3, 4, 5}, {0, -1, 0}));
}

TEST(Index, CoarserCellsCoverTheBox) {
  const Index3 factor = {1, 2, 4};
  EXPECT_EQ(coarser_extent({3, 4, 5}, factor), (Index3{3, 2, 2}));
  EXPECT_EQ(coarser_index({2, 3, 4}, factor), (Index3{2, 1, 1}));
}

TEST(Nodes, AreCountedAsManyAsAreNumbered) {
  std::mt19937 random(3);
  for (const std::int32_t size : {1, 2, 5, 12, 4000})  // the last: a few cells in a large box
    for (int trial = 0; trial < 20; ++trial) {
      std::vector<Index3> cells;
      for (int n = 0; n < 60; ++n) {
        Index3 c;
        for (std::int32_t& i : c) i = static_cast<std::int32_t>(random() % static_cast<unsigned>(size));
        if (c[2] % 5 != 3) cells.push_back(c);  // with layers left out
      }
      std::sort(cells.begin(), cells.end(), i_fastest);
      cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
      EXPECT_EQ(count_nodes(cells), number_nodes(cells).nodes.size());
    }
}

}  // namespace test_index
