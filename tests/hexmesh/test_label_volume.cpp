// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>

#include "hexmesh/scan/label_volume.h"
#include "hexmesh/scan/resample.h"
#include "support/bodies.h"
#include "support/files.h"

using namespace hexmesh;
using testing_support::make_volume;
using testing_support::message_of;
using testing_support::random_rotation;

namespace {

LabelVolume blob() {
  return make_volume({4, 5, 6}, {1, 2, 3}, [](const Index3& v) { return (v[0] + 2 * v[1] + 5 * v[2]) % 3; });
}

/// The same body stored with its axes permuted and flipped.
LabelVolume stored_as(const LabelVolume& volume, const std::array<int, 3>& order, int flips) {
  Index3 extent;
  Vec3 spacing, first = Vec3::Zero();
  Mat3 direction;
  for (int d = 0; d < 3; ++d) {
    const int s = order[static_cast<std::size_t>(d)];
    const bool flip = (flips >> d & 1) != 0;
    extent[static_cast<std::size_t>(d)] = volume.grid.extent()[static_cast<std::size_t>(s)];
    spacing[d] = volume.grid.spacing()[s];
    direction.col(d) = (flip ? -1.0 : 1.0) * volume.grid.direction().col(s);
    if (flip) first[s] = volume.grid.extent()[static_cast<std::size_t>(s)] - 1;
  }
  LabelVolume out{Grid(extent, spacing, volume.grid.position(first), direction),
                  std::vector<std::uint16_t>(volume.labels.size()), volume.segments};
  for (std::size_t n = 0; n < out.labels.size(); ++n) {
    const Index3 v = out.grid.index(n);
    const Vec3 index = volume.grid.continuous_index(out.grid.position(Vec3(v[0], v[1], v[2])));
    out.labels[n] = volume.labels[volume.grid.offset({static_cast<int>(std::lround(index[0])),
                                                      static_cast<int>(std::lround(index[1])),
                                                      static_cast<int>(std::lround(index[2]))})];
  }
  return out;
}

}  // namespace

TEST(LabelVolume, All48OrientationsOfOneScanGiveTheSameVoxels) {
  const LabelVolume volume = blob();
  std::array<int, 3> order = {0, 1, 2};
  do {
    for (int flips = 0; flips < 8; ++flips) {
      const LabelVolume back = reorient_to_lps(stored_as(volume, order, flips));
      ASSERT_TRUE(same_grid(back.grid, volume.grid));
      ASSERT_EQ(back.labels, volume.labels);
    }
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST(LabelVolume, ReorientingAnObliqueScanKeepsEveryVoxelWhereItIs) {
  LabelVolume volume = blob();
  volume.grid = Grid(volume.grid.extent(), volume.grid.spacing(), {1, 2, 3}, testing_support::random_rotation(5));
  const LabelVolume turned = reorient_to_lps(volume);
  EXPECT_GT(turned.grid.direction().determinant(), 0);
  for (std::size_t n = 0; n < volume.labels.size(); ++n) {
    const Index3 v = volume.grid.index(n);
    const Vec3 at = turned.grid.continuous_index(volume.grid.position(Vec3(v[0], v[1], v[2])));
    const Index3 w = {static_cast<int>(std::lround(at[0])), static_cast<int>(std::lround(at[1])),
                      static_cast<int>(std::lround(at[2]))};
    ASSERT_EQ(turned.labels[turned.grid.offset(w)], volume.labels[n]);
  }
}

TEST(LabelVolume, SelectsByLabelAndByNameAndRenames) {
  LabelVolume volume = blob();
  volume.segments[1].name = "Vena cava";
  const LabelVolume kept = select_segments(volume, {{"2", "vein"}});
  ASSERT_EQ(kept.segments.size(), 1U);
  EXPECT_EQ(kept.segments[0].name, "vein");
  EXPECT_EQ(count_voxels(kept)[0], count_voxels(volume)[1]);
  EXPECT_EQ(select_segments(volume, {{"vena CAVA", ""}}).segments[0].label, 2);
}

TEST(LabelVolume, AnUnknownSegmentIsNamedWithThoseThatExist) {
  const std::string message = message_of(ErrorKind::input, [] { select_segments(blob(), {{"spleen", ""}}); });
  EXPECT_EQ(message, "unknown segment 'spleen', expected one of: 1=segment_1, 2=segment_2");
}

TEST(LabelVolume, OverlayLetsTheLaterOneWinAndCountsTheOverlap) {
  const auto half = [](int axis) {
    return make_volume({4, 4, 4}, {1, 1, 1}, [axis](const Index3& v) { return v[static_cast<std::size_t>(axis)] < 2; });
  };
  LabelVolume tumour = half(1);
  tumour.segments[0].name = "tumour";
  std::size_t overlap = 0;
  const LabelVolume both = overlay(half(0), tumour, overlap);
  EXPECT_EQ(overlap, 16U);
  EXPECT_EQ(count_voxels(both), (std::vector<std::size_t>{16, 32}));
  EXPECT_EQ(both.segments[1].name, "tumour");
}

TEST(LabelVolume, OverlayRefusesAnotherGrid) {
  const LabelVolume a = make_volume({2, 2, 2}, {1, 1, 1}, [](const Index3&) { return 1; });
  const LabelVolume b = make_volume({2, 2, 2}, {1, 1, 2}, [](const Index3&) { return 1; });
  std::size_t overlap = 0;
  EXPECT_NE(message_of(ErrorKind::input, [&] { overlay(a, b, overlap); }).find("different grids"), std::string::npos);
}

TEST(Resample, KeepsTheBodyWhereItIs) {
  // Boxes of whole millimetres on a 1 x 1 x 2.5 mm grid, for cells of 3 mm: voxels of 0.75 x 0.75 x 3 mm.
  const Mat3 direction = random_rotation(5);
  const LabelVolume volume = make_volume(
      {30, 24, 20}, {1, 1, 2.5},
      [](const Index3& v) { return v[0] >= 6 && v[0] < 24 && v[1] >= 3 && v[1] < 21 && v[2] >= 6 && v[2] < 12; },
      direction, {5, 6, 7});
  const LabelVolume fine = resample_for_cells(volume, 3);
  EXPECT_LT((fine.grid.spacing() - Vec3(0.75, 0.75, 3)).norm(), 1e-12);
  const Vec3 corner = Vec3::Constant(-0.5);
  EXPECT_LT((fine.grid.position(corner) - volume.grid.position(corner)).norm(), 1e-9);
  for (std::size_t n = 0; n < fine.labels.size(); ++n) {
    const Index3 v = fine.grid.index(n);
    const Vec3 old = volume.grid.continuous_index(fine.grid.position(Vec3(v[0], v[1], v[2])));
    const Index3 nearest = {static_cast<std::int32_t>(std::lround(old[0])),
                            static_cast<std::int32_t>(std::lround(old[1])),
                            static_cast<std::int32_t>(std::lround(old[2]))};
    const bool inside = volume.grid.contains(nearest) && volume.labels[volume.grid.offset(nearest)] != 0;
    ASSERT_EQ(fine.labels[n] != 0, inside) << n;
  }
  EXPECT_NE(message_of(ErrorKind::usage, [&] { resample_for_cells(volume, 0); }).find("cell size is 0 mm"),
            std::string::npos);
  EXPECT_NE(message_of(ErrorKind::usage, [&] { resample_for_cells(volume, 1e-4); }).find("at most 2^31"),
            std::string::npos);
}
