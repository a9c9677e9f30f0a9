// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "hexmesh/geometry/solid.h"

namespace hexmesh::test_solid {

Vec3 any(std::mt19937& dice, double size) {
  std::uniform_real_distribution<double> in(-size, size);
  const double x = in(dice), y = in(dice);
  return {x, y, in(dice)};
}

/// A box as triangles.
TriangleSurface triangles_of(const Block& block) {
  TriangleSurface out;
  for (int c = 0; c < 8; ++c) {
    const Vec3 corner(c & 1 ? 1 : -1, c & 2 ? 1 : -1, c & 4 ? 1 : -1);
    out.points.emplace_back(block.center + block.axes * block.half.cwiseProduct(corner));
  }
  for (const std::array<int, 4>& face : {std::array{0, 2, 3, 1}, std::array{4, 5, 7, 6}, std::array{0, 1, 5, 4},
                                         std::array{2, 6, 7, 3}, std::array{0, 4, 6, 2}, std::array{1, 3, 7, 5}}) {
    out.triangles.push_back({face[0], face[1], face[2]});
    out.triangles.push_back({face[0], face[2], face[3]});
  }
  return out;
}

const Block block{Vec3(1, 2, 3), Eigen::AngleAxisd(0.7, Vec3(1, -2, 2).normalized()).toRotationMatrix(), Vec3(3, 4, 5)};
const std::vector<Solid>& solids() {
  static const std::vector<Solid> all = {HalfSpace{Vec3(1, 0, 2), Vec3(1, 2, 2) / 3},
                                         Ball{Vec3(1, 0, 2), 4},
                                         Capsule{Vec3(-2, 0, 1), Vec3(3, 1, 2), 3},
                                         Cylinder{Vec3(-2, 0, 1), Vec3(5, 1, 2), 3},
                                         block,
                                         std::make_shared<const Enclosed>(triangles_of(block))};
  return all;
}

/// Distances: their gradient has length 1 and is the normal, and bending is its derivative.
TEST(Solid, GapsAreDistances) {
  std::mt19937 dice(3);
  constexpr double h = 1e-5;
  for (const Solid& solid : solids()) {
    int inside = 0;
    for (int n = 0; n < 300; ++n) {
      const Vec3 x = any(dice, 8), way = any(dice, 1).normalized();
      const Gap g = gap_to(solid, x), ahead = gap_to(solid, x + h * way), behind = gap_to(solid, x - h * way);
      EXPECT_NEAR(g.normal.norm(), 1, 1e-12);
      if ((ahead.normal - behind.normal).norm() > 0.1) continue;  // over the middle, where distances have a kink
      EXPECT_NEAR((ahead.depth - behind.depth) / (2 * h), g.normal.dot(way), 1e-5) << solid.index();
      if (g.depth > 0) continue;
      ++inside;
      EXPECT_LT(((ahead.normal - behind.normal) / (2 * h) - g.bending * way).norm(), 1e-4) << solid.index();
    }
    EXPECT_GT(inside, 10);
  }
}

TEST(Solid, TrianglesOfABlockAreTheBlock) {
  std::mt19937 dice(5);
  for (int n = 0; n < 2000; ++n) {
    const Vec3 x = any(dice, 9);
    const Gap expected = gap_to(block, x), found = gap_to(solids().back(), x);
    EXPECT_NEAR(found.depth, expected.depth, 1e-9);
    if (expected.depth < -1e-3) {
      EXPECT_LT((found.normal - expected.normal).norm(), 1e-6) << expected.depth;
    }
  }
  // Nearest to an edge and to a corner, where the plane of one triangle alone tells the wrong side.
  for (int c = 0; c < 8; ++c) {
    const Vec3 corner(c & 1 ? 1 : -1, c & 2 ? 1 : -1, c & 4 ? 1 : -1);
    const Vec3 out = block.center + block.axes * block.half.cwiseProduct(1.1 * corner);
    EXPECT_GT(gap_to(solids().back(), out).depth, 0);
  }
}

TEST(Solid, ElsewhereItIsTheSame) {
  std::mt19937 dice(7);
  Eigen::Isometry3d to = Eigen::Translation3d(3, -2, 1) * Eigen::AngleAxisd(1.1, Vec3(2, 1, -1).normalized());
  for (const Solid& solid : solids())
    for (int n = 0; n < 50; ++n) {
      const Vec3 x = any(dice, 8);
      const Gap before = gap_to(solid, x), after = gap_to(placed(solid, to), to * x);
      EXPECT_NEAR(after.depth, before.depth, 1e-9);
    }
  EXPECT_NEAR(thickness_of(Ball{Vec3::Zero(), 3}), 3, 1e-12);
  EXPECT_NEAR(reach_of(solids().back(), block.center), block.half.norm(), 1e-9);
}

}  // namespace hexmesh::test_solid
