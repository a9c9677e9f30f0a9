// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>

#include "hexmesh/volume/label_volume.h"
#include "hexmesh/volume/resample.h"
#include "support/bodies.h"
#include "support/files.h"

namespace test_label_volume {

using namespace hexmesh;
using testing_support::make_volume;
using testing_support::message_of;
using testing_support::random_rotation;
using testing_support::stored_as;

LabelVolume blob() {
  return make_volume({4, 5, 6}, {1, 2, 3}, [](const Index3& v) { return (v[0] + 2 * v[1] + 5 * v[2]) % 3; });
}

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
  for (unsigned seed = 1; seed <= 40; ++seed) {
    LabelVolume volume = blob();
    volume.grid = Grid(volume.grid.extent(), volume.grid.spacing(), {1, 2, 3}, random_rotation(seed));
    const LabelVolume turned = reorient_to_lps(volume);
    ASSERT_GT(turned.grid.direction().determinant(), 0);
    for (std::size_t n = 0; n < volume.labels.size(); ++n) {
      const Index3 v = volume.grid.index(n);
      const Vec3 at = turned.grid.continuous_index(volume.grid.position(Vec3(v[0], v[1], v[2])));
      const Index3 w = {static_cast<int>(std::lround(at[0])), static_cast<int>(std::lround(at[1])),
                        static_cast<int>(std::lround(at[2]))};
      ASSERT_EQ(turned.labels[turned.grid.offset(w)], volume.labels[n]);
    }
  }
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

}  // namespace test_label_volume
