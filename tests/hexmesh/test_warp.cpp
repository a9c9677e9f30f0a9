// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "hexmesh/surface/extract.h"
#include "hexmesh/volume/segmentation.h"
#include "hexmesh/warp/bounds.h"
#include "hexmesh/warp/deform.h"
#include "hexmesh/warp/warp.h"
#include "support/bodies.h"

namespace test_warp {

using namespace hexmesh;
using namespace testing_support;

/// Around the body, of voxels that fit neither the lattice nor its axes.
Grid odd_grid(const Result& r) {
  const Bounds b = bounds_of(r);
  const Vec3 spacing(0.7, 1.1, 0.9), size = (b.high - b.low).array() + 12;
  const Mat3 axes = Eigen::AngleAxisd(0.2, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  const double radius = size.norm() / 2;
  const auto count = [&](int d) { return static_cast<std::int32_t>(2 * radius / spacing[d]); };
  return Grid({count(0), count(1), count(2)}, spacing, (b.low + b.high) / 2 - axes * Vec3::Constant(radius), axes);
}

Vec3 center(const Grid& grid, std::size_t n) {
  const Index3 v = grid.index(n);
  return grid.position(Vec3(v[0], v[1], v[2]));
}

/// Bends and stretches: gradients up to about a half.
Vec3 bend(const Vec3& x) {
  return Vec3(4 * std::sin(0.11 * x[1]), 0.02 * x[0] * x[0] - 0.1 * x[1], 3 * std::cos(0.13 * x[0]) + 0.1 * x[2]);
}

TEST(Warp, TheWayBackFromAnAffineMapIsExactAndOnlyWhereTheMaterialIs) {
  const Lattice lattice = bitten_ball({1, 1.2, 0.8}, {0, 0, 0}, random_rotation(4));
  Mat3 gradient;
  gradient << 0.2, -0.1, 0.3, 0.05, -0.2, 0.1, -0.3, 0.2, 0.1;
  const Vec3 shift(5, -3, 2);
  for (const int level : {0, 1, 2}) {
    const Result r = displaced(lattice, level, [&](const Vec3& x) -> Vec3 { return gradient * x + shift; });
    const Grid grid = odd_grid(r);
    const DisplacementField field = displacement_to_rest(r, grid);
    const Mat3 back = (Mat3::Identity() + gradient).inverse();
    std::size_t inside = 0;
    for (std::size_t n = 0; n < grid.num_voxels(); ++n) {
      const Vec3 x = center(grid, n), rest = back * (x - shift);
      const bool is_material = label_at(lattice.voxels, lattice.labels, rest) != 0;
      if (std::isnan(field.values[n][0])) {
        // Rounding on a voxel's face may go either way.
        const Vec3 index = lattice.voxels.continuous_index(rest);
        const double to_face = ((index.array() - 0.5) - (index.array() - 0.5).round()).abs().minCoeff();
        EXPECT_TRUE(!is_material || to_face < 1e-3) << level;
        continue;
      }
      ++inside;
      ASSERT_LT((x + field.values[n].cast<double>() - rest).norm(), 1e-5) << level;
    }
    const double volume = static_cast<double>(inside) * grid.voxel_volume();
    double material = 0;
    for (const std::uint16_t label : lattice.labels) material += label != 0 ? lattice.voxels.voxel_volume() : 0;
    EXPECT_NEAR(volume / (material * (Mat3::Identity() + gradient).determinant()), 1, 0.02) << level;
  }
}

TEST(Warp, TheTwoDirectionsUndoEachOtherInTheBody) {
  const Lattice lattice = bitten_ball({1, 1, 1.3});
  for (const int level : {0, 1, 2}) {
    const Result r = displaced(lattice, level, bend);
    const WarpCheck check = check_warp(r, make_warp(r));
    EXPECT_GT(check.voxels, 500U);
    EXPECT_LT(check.mean, 0.01) << level;
    EXPECT_LT(check.largest, 0.1) << level;
  }
}

TEST(Warp, AStillBodyStaysWhereItIs) {
  const Lattice lattice = bitten_ball({1, 1, 1});
  const Result r = displaced(lattice, 1, [](const Vec3&) -> Vec3 { return Vec3::Zero(); });
  const Warp warp = make_warp(r);
  for (const Eigen::Vector3f& v : warp.to_rest.values) ASSERT_LT(v.norm(), 1e-5);
  EXPECT_EQ(deformed_labels(r, warp.to_rest, lattice.voxels).labels, lattice.labels);
}

TEST(Warp, AShiftByWholeVoxelsShiftsLabelsAndGreyValues) {
  const Lattice lattice = bitten_ball({1, 1, 1});
  const Result r = displaced(lattice, 1, [](const Vec3&) -> Vec3 { return {3, 0, -2}; });
  IntensityVolume scan{lattice.voxels, std::vector<float>(lattice.labels.size())};
  for (std::size_t n = 0; n < scan.values.size(); ++n) scan.values[n] = static_cast<float>((n * 7919) % 251);
  const Grid grid = fitted_grid(r);
  const Warp warp = make_warp(r);
  const LabelVolume labels = deformed_labels(r, warp.to_rest, grid);
  const IntensityVolume moved = deform(r, scan, warp.to_rest, grid);
  std::size_t count = 0;
  for (std::size_t n = 0; n < lattice.labels.size(); ++n) {
    if (lattice.labels[n] == 0) continue;
    const Vec3 index = grid.continuous_index(center(lattice.voxels, n) + Vec3(3, 0, -2));
    const Index3 v = {static_cast<std::int32_t>(std::lround(index[0])),
                      static_cast<std::int32_t>(std::lround(index[1])),
                      static_cast<std::int32_t>(std::lround(index[2]))};
    ASSERT_TRUE(grid.contains(v));
    ASSERT_EQ(labels.labels[grid.offset(v)], lattice.labels[n]);
    ASSERT_NEAR(moved.values[grid.offset(v)], scan.values[n], 0.05);
    ++count;
  }
  EXPECT_EQ(count, static_cast<std::size_t>(std::count_if(labels.labels.begin(), labels.labels.end(),
                                                          [](std::uint16_t l) { return l != 0; })))
      << "the body is there once";
}

TEST(Warp, TheContinuationIsTheSolutionOfLaplacesEquationToAFewPerCent) {
  // A known ball in the middle; without sources the values stay between it and the border's.
  const Grid grid({31, 27, 23}, {1, 1, 1.5});
  DisplacementField field{grid, {}};
  const Vec3 middle = grid.position(Vec3(15, 13, 11));
  std::vector<bool> known;
  for (std::size_t n = 0; n < grid.num_voxels(); ++n) {
    known.push_back((center(grid, n) - middle).norm() < 6);
    field.values.push_back(known.back() ? Eigen::Vector3f(1, -2, 0) : Eigen::Vector3f::Constant(NAN));
  }
  continue_to_border(field);

  // The same by plain relaxation, until nothing changes.
  std::vector<double> solution(grid.num_voxels());
  for (int sweep = 0; sweep < 1500; ++sweep)
    for (std::size_t n = 0; n < grid.num_voxels(); ++n) {
      if (known[n]) {
        solution[n] = 1;
        continue;
      }
      double sum = 0, weights = 0;
      for (std::size_t d = 0; d < 3; ++d)
        for (const int side : {-1, 1}) {
          Index3 neighbour = grid.index(n);
          neighbour[d] += side;
          const double weight = std::pow(grid.spacing()[static_cast<Eigen::Index>(d)], -2);
          weights += weight;
          if (grid.contains(neighbour)) sum += weight * solution[grid.offset(neighbour)];
        }
      solution[n] = sum / weights;
    }
  for (std::size_t n = 0; n < grid.num_voxels(); ++n) {
    const Eigen::Vector3f& value = field.values[n];
    ASSERT_NEAR(value[0], solution[n], 0.05);
    ASSERT_TRUE(!known[n] || value[0] == 1);
    ASSERT_NEAR(value[1], -2 * value[0], 1e-5);
    ASSERT_EQ(value[2], 0);
  }
}

TEST(Warp, TheWarpsGridHoldsTheBodyAndAMarginOfItsMotion) {
  Lattice lattice = bitten_ball({1, 1, 1});
  append(lattice.surface, extract_surface(lattice, lattice.segments.front().segment.label));
  // Half the body at most, else one and a half the motion.
  const Bounds still = bounds_of(displaced(lattice, 0, [](const Vec3&) -> Vec3 { return Vec3::Zero(); }));
  const double half = (still.high - still.low).maxCoeff() / 2 - 1;
  for (const double motion : {8.0, 40.0}) {
    const Result r = displaced(lattice, 0, [&](const Vec3&) -> Vec3 { return {0, motion, 0}; });
    const Grid grid = warp_grid(r);
    EXPECT_TRUE(same_lattice_of_voxels(lattice.voxels, grid));
    const double margin = std::max(10.0, std::min(1.5 * motion, half)) - 0.5;
    for (const Vec3& p : r.surface.points)
      for (const Vec3& away :
           {Vec3(margin, 0, 0), Vec3(0, motion + margin, 0), Vec3(0, -margin, 0), Vec3(0, 0, -margin)})
        ASSERT_TRUE(grid.covers(grid.continuous_index(p + away)));
  }
}

TEST(Warp, ABodyThatMovesFartherThanItIsThickIsThereOnce) {
  const Lattice lattice = bitten_ball({1, 1, 1});
  const auto size = [](const std::vector<std::uint16_t>& labels) {
    return std::count_if(labels.begin(), labels.end(), [](std::uint16_t l) { return l != 0; });
  };
  for (const double motion : {15.0, 40.0, 150.0}) {
    const Result r = displaced(lattice, 1, [&](const Vec3&) -> Vec3 { return {0, motion, 0}; });
    const Warp warp = make_warp(r);
    const LabelVolume labels = deformed_labels(r, warp.to_rest, fitted_grid(r));
    EXPECT_EQ(size(labels.labels), size(lattice.labels)) << motion;
    EXPECT_LT(check_warp(r, warp).largest, 0.1) << motion;
    EXPECT_EQ(check_warp(r, warp).ghost_ml > 0, motion > 14) << "said where resampling filters would show it twice";
  }
}

TEST(Warp, BoundsAreThoseOfTheBodyAndNotOfItsPicture) {
  Lattice lattice = bitten_ball({1, 1, 1});
  append(lattice.surface, extract_surface(lattice, lattice.segments.back().segment.label));  // of a part of it
  const auto shift = [](const Vec3&) -> Vec3 { return {12, 0, 0}; };
  const Bounds with_part = bounds_of(displaced(lattice, 1, shift));
  lattice.surface = {};
  const Bounds without = bounds_of(displaced(lattice, 1, shift));
  EXPECT_LT((with_part.low - without.low).norm() + (with_part.high - without.high).norm(), 1e-12);
  // Turned and stretched: the farthest voxel's centre, and half a voxel.
  const auto stretch = [](const Vec3& x) -> Vec3 { return {0.5 * x[0], 0, 0.2 * x[0]}; };
  double farthest = -INFINITY;
  for (std::size_t n = 0; n < lattice.labels.size(); ++n)
    if (lattice.labels[n] != 0) farthest = std::max(farthest, 1.5 * center(lattice.voxels, n)[0]);
  EXPECT_NEAR(bounds_of(displaced(lattice, 1, stretch)).high[0], farthest + 0.5, 1e-9);
  const Vec3 box = lattice.voxels.corner(7).array() + 1;
  EXPECT_NEAR(with_part.high[0] - with_part.low[0], box[0] + 12, 1e-9) << "the box fits the voxels";
}

TEST(Warp, WhatIsOutsideTheScanHasItsLowestValue) {
  const Lattice lattice = bitten_ball({1, 1, 1});
  const Result r = displaced(lattice, 1, [](const Vec3&) -> Vec3 { return Vec3::Zero(); });
  IntensityVolume scan{Grid({6, 6, 6}, {1, 1, 1}, lattice.voxels.position(Vec3(4, 4, 4))), std::vector<float>(216, 50)};
  scan.values[0] = NAN;
  scan.values[7] = -1000;
  const IntensityVolume out = deform(r, scan, make_warp(r).to_rest, lattice.voxels);
  EXPECT_EQ(out.values[0], -1000);
  EXPECT_TRUE(std::all_of(out.values.begin(), out.values.end(), [](float v) { return std::isfinite(v); }));
}

}  // namespace test_warp
