// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "hexmesh/core/error.h"
#include "hexmesh/core/partition.h"
#include "hexmesh/surface/surface_file.h"
#include "hexmesh/surface/voxelize.h"
#include "support/bodies.h"
#include "support/files.h"

namespace test_voxelize {

using namespace hexmesh;
using namespace testing_support;

/// A box of twelve triangles that face outwards, turned about the origin.
TriangleSurface box_surface(const Vec3& low, const Vec3& high, const Mat3& turn = Mat3::Identity()) {
  TriangleSurface s;
  for (int a = 0; a < 8; ++a)
    s.points.push_back(turn * Vec3((a & 1) ? high[0] : low[0], (a & 2) ? high[1] : low[1], (a & 4) ? high[2] : low[2]));
  s.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                 {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return s;
}

TriangleSurface inwards(TriangleSurface s) {
  for (auto& t : s.triangles) std::swap(t[0], t[1]);
  return s;
}

TriangleSurface both(TriangleSurface a, const TriangleSurface& b) {
  append(a, b);
  return a;
}

std::set<std::size_t> where(const Grid& grid, const std::function<bool(const Vec3&)>& inside) {
  std::set<std::size_t> out;
  for (std::size_t n = 0; n < grid.num_voxels(); ++n) {
    const Index3 v = grid.index(n);
    if (inside(grid.position(Vec3(v[0], v[1], v[2])))) out.insert(n);
  }
  return out;
}

std::set<std::size_t> voxels_of(const TriangleSurface& surface, const Grid& grid) {
  const Voxelization v = voxelize({surface, {}}, grid);
  return {v.voxels.begin(), v.voxels.end()};
}

/// Parts of a set of voxels connected through faces.
std::size_t count_parts(const std::vector<std::size_t>& voxels, const Grid& grid) {
  std::map<std::size_t, std::int32_t> number;
  for (const std::size_t n : voxels) number.emplace(n, static_cast<std::int32_t>(number.size()));
  Partition partition(number.size());
  std::size_t parts = number.size();
  for (const auto& [n, at] : number) {
    const Index3 v = grid.index(n);
    for (std::size_t d = 0; d < 3; ++d) {
      Index3 next = v;
      if (++next[d] >= grid.extent()[d]) continue;
      if (const auto found = number.find(grid.offset(next)); found != number.end())
        parts -= partition.join(at, found->second);
    }
  }
  return parts;
}

const Grid cube({24, 24, 24}, {1, 1, 1}, {-11.5, -11.5, -11.5});

TEST(Voxelize, AClosedSurfaceFillsTheVoxelsWhoseCentresLieInside) {
  for (const Mat3& turn : {Mat3(Mat3::Identity()), random_rotation(3), random_rotation(8)}) {
    const Vec3 low(-7, -6, -5), high(4, 7, 6);
    const auto inside = [&](const Vec3& p) {
      const Vec3 q = turn.transpose() * p;
      return (q.array() > low.array()).all() && (q.array() < high.array()).all();
    };
    EXPECT_EQ(voxels_of(box_surface(low, high, turn), cube), where(cube, inside));
    EXPECT_EQ(voxels_of(inwards(box_surface(low, high, turn)), cube), where(cube, inside));
  }
}

TEST(Voxelize, PointsOfTheSurfaceOnVoxelCentresAreNoTrouble) {
  // A diamond whose corners and edges meet the lines through the voxel centres.
  const Grid grid({13, 13, 13}, {1, 1, 1}, {-6, -6, -6});
  TriangleSurface s;
  s.points = {{-5, 0, 0}, {5, 0, 0}, {0, -5, 0}, {0, 5, 0}, {0, 0, -5}, {0, 0, 5}};
  for (const int x : {0, 1})
    for (const int y : {2, 3})
      for (const int z : {4, 5}) {
        const bool outwards = ((x + y + z) & 1) != 0;
        s.triangles.push_back(outwards ? std::array{x, y, z} : std::array{y, x, z});
      }
  ASSERT_EQ(count_open_edges(s), 0U);
  const std::set<std::size_t> voxels = voxels_of(s, grid);
  for (std::size_t n = 0; n < grid.num_voxels(); ++n) {
    const Index3 v = grid.index(n);
    const int distance = std::abs(v[0] - 6) + std::abs(v[1] - 6) + std::abs(v[2] - 6);
    if (distance == 5) continue;  // on the surface
    EXPECT_EQ(voxels.contains(n), distance < 5) << distance;
  }
}

TEST(Voxelize, BodiesThatCrossAreJoinedAndOnesThatFaceInwardsAreHoles) {
  const TriangleSurface a = box_surface({-8, -4, -4}, {2, 4, 4}), b = box_surface({-2, -4, -4}, {8, 4, 4});
  EXPECT_EQ(voxels_of(both(a, b), cube), voxels_of(box_surface({-8, -4, -4}, {8, 4, 4}), cube));
  const TriangleSurface outer = box_surface({-8, -8, -8}, {8, 8, 8}),
                        hole = inwards(box_surface({-3, -3, -3}, {3, 3, 3}));
  EXPECT_EQ(voxels_of(both(outer, hole), cube).size(), 16U * 16 * 16 - 6 * 6 * 6);
}

TEST(Voxelize, TrianglesThatFaceBothWaysAreMended) {
  TriangleSurface s = box_surface({-8, -4, -4}, {2, 4, 4});
  std::swap(s.triangles[3][0], s.triangles[3][1]);
  const Voxelization v = voxelize({s, {}}, cube);
  EXPECT_EQ(v.mended_parts, 1U);
  EXPECT_EQ(v.voxels.size(), 10U * 8 * 8);
}

TEST(Voxelize, AnOpenSheetIsOneLayerConnectedThroughFaces) {
  TriangleSurface sheet;
  sheet.points = {{-5.9, -5.9, 1}, {5.9, -5.9, 1}, {5.9, 5.9, 1}, {-5.9, 5.9, 1}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  const Voxelization flat = voxelize({sheet, {}}, cube);  // between two layers of voxels: one of them
  EXPECT_EQ(flat.open_parts, 1U);
  EXPECT_EQ(flat.voxels.size(), 12U * 12);
  for (Vec3& p : sheet.points) p = random_rotation(5) * p;
  const Voxelization oblique = voxelize({sheet, {}}, cube);
  EXPECT_EQ(count_parts(oblique.voxels, cube), 1U);
  // Each voxel is crossed by the sheet: no centre farther off than half of a voxel's diagonal.
  const Vec3 normal = (sheet.points[1] - sheet.points[0]).cross(sheet.points[2] - sheet.points[0]).normalized();
  for (const std::size_t n : oblique.voxels) {
    const Index3 v = cube.index(n);
    EXPECT_LE(std::abs((cube.position(Vec3(v[0], v[1], v[2])) - sheet.points[0]).dot(normal)),
              std::sqrt(3.0) / 2 + 1e-6);
  }
}

TEST(Voxelize, ALineIsAChainConnectedThroughFaces) {
  const std::vector<std::vector<Vec3>> line = {{{-9, -8, -7}, {3, 2, 8}, {9, -5, 9}}};
  const Voxelization v = voxelize({{}, line}, cube);
  EXPECT_EQ(count_parts(v.voxels, cube), 1U);
  EXPECT_LT(v.voxels.size(), 70U);
  EXPECT_EQ(voxelize({{}, {{{-9, 0.5, 0.5}, {9, 0.5, 0.5}}}}, cube).voxels.size(), 19U);
}

TEST(Voxelize, TheVolumeOfABallConverges) {
  // An octahedron refined onto the sphere.
  TriangleSurface ball;
  ball.points = {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}};
  for (const int x : {0, 1})
    for (const int y : {2, 3})
      for (const int z : {4, 5})
        ball.triangles.push_back(((x + y + z) & 1) != 0 ? std::array{x, y, z} : std::array{y, x, z});
  for (int level = 0; level < 5; ++level) {
    TriangleSurface finer;
    for (const auto& t : ball.triangles) {
      const auto first = static_cast<std::int32_t>(finer.points.size());
      for (std::size_t a = 0; a < 3; ++a) finer.points.push_back(ball.points[t[a]]);
      for (std::size_t a = 0; a < 3; ++a)
        finer.points.push_back((ball.points[t[a]] + ball.points[t[(a + 1) % 3]]).normalized());
      for (const auto& [a, b, c] : {std::array{0, 3, 5}, {1, 4, 3}, {2, 5, 4}, {3, 4, 5}})
        finer.triangles.push_back({first + a, first + b, first + c});
    }
    ball = std::move(finer);
  }
  for (Vec3& p : ball.points) p = 10 * p + Vec3(0.1, 0.2, 0.3);
  const Grid grid = grid_around({{ball, {}}}, 0.5);
  const Voxelization v = voxelize({ball, {}}, grid);
  EXPECT_EQ(v.closed_parts, 1U);
  const double exact = 4.0 / 3 * std::numbers::pi * 1000;
  EXPECT_NEAR(1000 * v.enclosed_ml, exact, 0.003 * exact);
  EXPECT_NEAR(static_cast<double>(v.voxels.size()) * 0.125, 1000 * v.enclosed_ml, 0.003 * exact);
}

TEST(Voxelize, AGridLiesAroundAllShapes) {
  const Grid grid = grid_around({{box_surface({0, 0, 0}, {10, 4, 3}), {}}}, 1);
  EXPECT_EQ(grid.extent(), (Index3{14, 8, 7}));
  EXPECT_EQ(grid.position(Vec3(2, 2, 2)), Vec3(0.5, 0.5, 0.5));
  EXPECT_NE(message_of(ErrorKind::usage,
                       [] {
                         grid_around({{box_surface({0, 0, 0}, {1e6, 1, 1}), {}}}, 1);
                       })
                .find("--spacing"),
            std::string::npos);
}

TEST(SurfaceFile, LinesOfAnObjAreRead) {
  const TemporaryFolder folder;
  write_text(folder / "a.obj", "v 0 0 0\nv 1 0 0\nv 1 2 0\nl 1 2 -1\n");
  const Shape shape = read_shape(folder / "a.obj");
  ASSERT_EQ(shape.lines.size(), 1U);
  EXPECT_EQ(shape.lines[0].back(), Vec3(1, 2, 0));
  write_text(folder / "b.obj", "v 0 0 0\nl 1 2\n");
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_shape(folder / "b.obj"); }).find("point 2, expected 1 to 1"),
            std::string::npos);
}

TEST(SurfaceFile, PolygonsOfAnOffAreSplit) {
  const TemporaryFolder folder;
  write_text(folder / "a.off", "OFF\n# a square\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n\n4 0 1 2 3 255 0 0\n");
  const Shape shape = read_shape(folder / "a.off");
  EXPECT_EQ(shape.surface.points.size(), 4U);
  ASSERT_EQ(shape.surface.triangles.size(), 2U);
  EXPECT_EQ(shape.surface.triangles[1], (std::array<std::int32_t, 3>{0, 2, 3}));
  write_text(folder / "b.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n1 1 0\n3 0 1 7\n");
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_shape(folder / "b.off"); }).find("point 7, expected below 3"),
            std::string::npos);
}

}  // namespace test_voxelize
