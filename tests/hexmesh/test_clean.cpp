// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "hexmesh/scan/clean.h"
#include "support/bodies.h"

namespace test_clean {

using namespace hexmesh;
using testing_support::make_volume;

using Counts = std::vector<std::size_t>;

/// Distance of a voxel's centre from that of voxel c [mm].
double distance(const Index3& v, const Index3& c, const Vec3& spacing) {
  return spacing.cwiseProduct(Vec3(v[0] - c[0], v[1] - c[1], v[2] - c[2])).norm();
}

TEST(Clean, KeepsTheLargestPartOfEachSegmentConnectedThroughFaces) {
  // Two blocks that touch along an edge only, and a speck of another segment.
  LabelVolume volume = make_volume({6, 6, 2}, {1, 1, 1}, [](const Index3& v) {
    if (v[0] < 3 && v[1] < 3) return 1;
    if (v[0] == 3 && v[1] == 3) return 1;
    return v[0] == 5 && v[1] == 5 ? 2 : 0;
  });
  const Cleaning cleaning = keep_largest_component(volume);
  EXPECT_EQ(cleaning.removed, (Counts{2, 0}));
  EXPECT_EQ(cleaning.added, (Counts{0, 0}));
  EXPECT_EQ(count_voxels(volume), (Counts{18, 2}));
}

TEST(Clean, SpecksGoByTheirVolume) {
  // Parts of 8, 2 and 1 voxels of 0.5 mL.
  LabelVolume volume = make_volume({9, 4, 4}, {5, 10, 10}, [](const Index3& v) {
    return (v[0] < 2 && v[1] < 2 && v[2] < 2) || (v[0] >= 4 && v[0] < 6 && v[1] == 0 && v[2] == 0) ||
           v == Index3{8, 3, 3};
  });
  EXPECT_EQ(remove_specks(volume, 1.0).removed, (Counts{1}));
  EXPECT_EQ(remove_specks(volume, 1.1).removed, (Counts{2}));
  EXPECT_EQ(count_voxels(volume), (Counts{8}));
}

TEST(Clean, CavitiesAreFilledOtherSegmentsAndBaysAreNot) {
  // A block with a closed hole, a hole that holds a tumour, and a bay open to the outside; at the volume's border.
  LabelVolume volume = make_volume({9, 5, 5}, {1, 1, 1}, [](const Index3& v) {
    if (v == Index3{2, 2, 2}) return 0;
    if (v == Index3{4, 2, 2}) return 2;
    if (v == Index3{6, 2, 2} || v == Index3{6, 2, 3} || v == Index3{6, 2, 4}) return 0;
    return 1;
  });
  const Cleaning cleaning = fill_cavities(volume);
  EXPECT_EQ(cleaning.added, (Counts{1, 0}));
  EXPECT_EQ(volume.labels[volume.grid.offset({4, 2, 2})], 2);
  EXPECT_EQ(volume.labels[volume.grid.offset({6, 2, 2})], 0);
}

TEST(Clean, OpeningRemovesWhatNoBallFitsInto) {
  // A ball of 6 mm with a spike, on flat voxels; the spike goes, the ball loses nothing of its inside.
  const Vec3 spacing(1, 1, 2);
  LabelVolume volume = make_volume({31, 21, 15}, spacing, [&](const Index3& v) {
    return distance(v, {10, 10, 7}, spacing) <= 6 || (v[1] == 10 && v[2] == 7 && v[0] >= 10 && v[0] < 28);
  });
  const Cleaning cleaning = open_segments(volume, 2);
  EXPECT_GE(cleaning.removed[0], 10U);
  EXPECT_EQ(cleaning.added[0], 0U);
  for (std::size_t n = 0; n < volume.labels.size(); ++n) {
    const double d = distance(volume.grid.index(n), {10, 10, 7}, spacing);
    if (d <= 4) {
      EXPECT_EQ(volume.labels[n], 1);
    } else if (d > 6.5) {
      EXPECT_EQ(volume.labels[n], 0);
    }
  }
}

TEST(Clean, ClosingFillsThinGapsAndIsTheOppositeOfOpening) {
  // Two blocks 2 mm apart; closing by 1 mm joins them, by less does not. What lies outside the volume is background.
  const auto blocks = [] {
    return make_volume({12, 6, 6}, {1, 1, 1}, [](const Index3& v) { return v[0] < 5 || v[0] > 6; });
  };
  LabelVolume volume = blocks();
  EXPECT_EQ(close_segments(volume, 0.9).added[0], 0U);
  const Cleaning cleaning = close_segments(volume, 1.5);
  EXPECT_GT(cleaning.added[0], 2U * 4 * 4 - 1);
  EXPECT_EQ(cleaning.removed[0], 0U);
  // Opening of the gap seen as a body is closing of the blocks: erosion is dilation of the complement.
  EXPECT_NE(volume.labels[volume.grid.offset({5, 3, 3})], 0);
}

}  // namespace test_clean
