// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "hexmesh/scan/clean.h"
#include "hexmesh/scan/isotropic.h"
#include "support/bodies.h"

namespace test_isotropic {

using namespace hexmesh;
using testing_support::make_volume;

Vec3 place_of(const Grid& grid, std::size_t n) {
  const Index3 v = grid.index(n);
  return grid.position(Vec3(v[0], v[1], v[2]));
}

TEST(Isotropic, CubicVoxelsOfTheSameEdgeAreTheSame) {
  const LabelVolume volume = make_volume({7, 6, 5}, {2, 2, 2}, [](const Index3& v) {
    return v[0] > 1 && v[0] < 5 && v[1] > 0 && v[1] < 5 && v[2] > 0 ? (v[0] == 3 ? 2 : 1) : 0;
  });
  const LabelVolume same = isotropic(volume, 2);
  EXPECT_TRUE(same_grid(same.grid, volume.grid));
  EXPECT_EQ(same.labels, volume.labels);
}

TEST(Isotropic, ABallOfThickSlicesIsRoundAndKeepsItsVolume) {
  constexpr double radius = 20;
  const Vec3 spacing(0.8, 0.8, 5);
  const Index3 extent = {61, 61, 12};
  const Vec3 middle = spacing.cwiseProduct(Vec3(30, 30, 5.5));
  const LabelVolume thick = make_volume(extent, spacing, [&](const Index3& v) {
    return (spacing.cwiseProduct(Vec3(v[0], v[1], v[2])) - middle).norm() <= radius;
  });
  const LabelVolume cubic = isotropic(thick, 0.8);
  const auto volume = [](const LabelVolume& v) {
    return static_cast<double>(count_voxels(v)[0]) * v.grid.voxel_volume();
  };
  EXPECT_NEAR(volume(cubic) / volume(thick), 1, 1e-4);
  // Where a voxel is wrong it is near the sphere: the staircase's corners were up to 2.5 mm and more off.
  const auto farthest_wrong = [&](const LabelVolume& v, const Vec3& about) {
    double most = 0;
    for (std::size_t n = 0; n < v.labels.size(); ++n) {
      const double out = (place_of(v.grid, n) - about).norm() - radius;
      if ((out <= 0) != (v.labels[n] != 0)) most = std::max(most, std::abs(out));
    }
    return most;
  };
  // The poles, where slices end, are flat; beside them it is within a voxel and a half.
  EXPECT_LT(farthest_wrong(cubic, thick.grid.position(Vec3(30, 30, 5.5))), 2.3);
  double wrong = 0;
  for (std::size_t n = 0; n < cubic.labels.size(); ++n) {
    const double out = (place_of(cubic.grid, n) - thick.grid.position(Vec3(30, 30, 5.5))).norm() - radius;
    wrong += (out <= 0) != (cubic.labels[n] != 0) ? cubic.grid.voxel_volume() : 0;
  }
  EXPECT_LT(wrong, 0.06 * volume(thick)) << "a staircase of 5 mm has 0.13";
}

TEST(Isotropic, SegmentsSideBySideKeepTheirVolumesAndThinOnesAreNotLost) {
  // A body with a ball in it, and a vessel one voxel thick that runs obliquely through the slices.
  const Vec3 spacing(1, 1, 3);
  const LabelVolume thick = make_volume({50, 40, 16}, spacing, [&](const Index3& v) {
    const Vec3 p = spacing.cwiseProduct(Vec3(v[0], v[1], v[2]));
    if (v[0] == 8 + 2 * v[2] && v[1] >= 19 && v[1] <= 20 && v[2] > 1 && v[2] < 14) return 3;
    if ((p - Vec3(30, 20, 24)).norm() < 7) return 2;
    return p[0] > 3 && p[0] < 46 && p[1] > 4 && p[1] < 35 && v[2] > 0 && v[2] < 15 ? 1 : 0;
  });
  for (const double edge : {1.0, 0.7}) {
    const LabelVolume cubic = isotropic(thick, edge);
    const auto before = count_voxels(thick), after = count_voxels(cubic);
    for (std::size_t s = 0; s < before.size(); ++s)
      EXPECT_NEAR(static_cast<double>(after[s]) * cubic.grid.voxel_volume() /
                      (static_cast<double>(before[s]) * thick.grid.voxel_volume()),
                  1, 0.005)
          << s << " at " << edge;
  }
}

TEST(Clean, KeepsTheComponentAtAPlace) {
  LabelVolume volume = make_volume({9, 3, 3}, {1, 1, 1}, [](const Index3& v) {
    return v[0] == 4 ? 0 : v[0] == 8 ? 2 : 1;
  });
  EXPECT_FALSE(keep_component_at(volume, volume.grid.position(Vec3(4, 1, 1))));
  EXPECT_EQ(count_voxels(volume), (std::vector<std::size_t>{63, 9}));
  EXPECT_TRUE(keep_component_at(volume, volume.grid.position(Vec3(6.2, 1, 1))));
  EXPECT_EQ(count_voxels(volume), (std::vector<std::size_t>{27, 0}));
  EXPECT_FALSE(keep_component_at(volume, Vec3(1000, 0, 0)));
}

}  // namespace test_isotropic
