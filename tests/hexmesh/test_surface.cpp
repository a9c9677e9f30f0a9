// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "hexmesh/surface/decimate.h"
#include "hexmesh/surface/extract.h"
#include "hexmesh/surface/surface_file.h"
#include "support/bodies.h"
#include "support/files.h"

namespace test_surface {

using namespace hexmesh;
using namespace testing_support;
namespace fs = std::filesystem;

TriangleSurface tetrahedron() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}, {1, 1, 1, 1}};
}

TEST(Surface, IsClosedOutwardAndEnclosesTheSegment) {
  const Lattice lattice = bitten_ball({1, 1, 2}, {0, 0, 0}, random_rotation(9));
  for (const std::uint16_t label : {std::uint16_t{1}, std::uint16_t{2}}) {
    const TriangleSurface surface = extract_surface(lattice, label);
    const double voxels = 2.0 * static_cast<double>(std::count(lattice.labels.begin(), lattice.labels.end(), label));
    // Marching cubes cuts the voxels' corners; at a few voxels' radius that is some per cent.
    EXPECT_NEAR(enclosed_volume(surface), voxels, 0.12 * voxels);
    EXPECT_EQ(count_open_edges(surface), 0U);
  }
}

TEST(Surface, DecimatedKeepsTheVolumeAndDoesNotCrossItself) {
  const Lattice lattice = bitten_ball({1, 1, 1});
  const TriangleSurface surface = extract_surface(lattice, 1);
  ASSERT_GT(surface.triangles.size(), 1000U);
  const TriangleSurface fewer = decimate(surface, 300);
  EXPECT_LE(fewer.triangles.size(), 300U);
  EXPECT_GE(fewer.triangles.size(), 250U);
  EXPECT_EQ(fewer.segment, std::vector<std::uint16_t>(fewer.triangles.size(), 1));
  EXPECT_EQ(count_open_edges(fewer), 0U);
  EXPECT_EQ(count_self_intersections(fewer), 0U);
  EXPECT_NEAR(enclosed_volume(fewer), enclosed_volume(surface), 0.01 * enclosed_volume(surface));
  EXPECT_EQ(decimate(surface, 1000000).triangles, surface.triangles);
}

TEST(Surface, CrossingTrianglesAreCounted) {
  TriangleSurface both = tetrahedron();
  EXPECT_EQ(count_self_intersections(both), 0U);
  TriangleSurface moved = tetrahedron();
  for (Vec3& p : moved.points) p += Vec3(0.2, 0.1, 0.15);
  append(both, moved);
  EXPECT_GT(count_self_intersections(both), 0U);
  EXPECT_NEAR(enclosed_volume(both), 2.0 / 6, 1e-12);
  both.triangles.pop_back();
  EXPECT_EQ(count_open_edges(both), 3U);
}

TEST(Surface, OneSegmentKeepsOnlyItsPoints) {
  TriangleSurface both = tetrahedron();
  TriangleSurface other = tetrahedron();
  other.segment.assign(4, 7);
  for (Vec3& p : other.points) p *= 2;
  append(both, other);
  const TriangleSurface back = of_segment(both, 7);
  EXPECT_EQ(back.points.size(), 4U);
  EXPECT_NEAR(enclosed_volume(back), 8.0 / 6, 1e-12);
}

TEST(SurfaceFile, ReadsBackWhatWasWritten) {
  const TemporaryFolder folder;
  const TriangleSurface surface = tetrahedron();
  for (const char* name : {"a.obj", "a.stl", "a.ply", "a.off"}) {
    write_surface(surface, folder / name);
    const TriangleSurface back = read_surface(folder / name);
    EXPECT_EQ(back.triangles.size(), 4U) << name;
    EXPECT_NEAR(enclosed_volume(back), 1.0 / 6, 1e-7) << name;
  }
}

TEST(SurfaceFile, RasIsTurnedToLpsWhereTheFileSaysSo) {
  const TemporaryFolder folder;
  write_text(folder / "ras.obj", "# SPACE=RAS\nv 1 2 3\nv 2 2 3\nv 1 3 3\nf 1 2 3\n");
  EXPECT_EQ(read_surface(folder / "ras.obj").points[0], Vec3(-1, -2, 3));
  write_text(folder / "lps.obj", "# SPACE=LPS\nv 1 2 3\nv 2 2 3\nv 1 3 3\nf 1 2 3\n");
  EXPECT_EQ(read_surface(folder / "lps.obj").points[0], Vec3(1, 2, 3));
}

TEST(SurfaceFile, PolygonsAreSplitAndBadOnesRefusedByName) {
  const TemporaryFolder folder;
  write_text(folder / "quad.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n");
  EXPECT_EQ(read_surface(folder / "quad.obj").triangles.size(), 2U);
  const auto refused = [&](const std::string& name, const std::string& content, const std::string& why = "") {
    write_text(folder / name, content);
    const std::string message = message_of(ErrorKind::input, [&] { read_surface(folder / name); });
    EXPECT_NE(message.find(name), std::string::npos);
    EXPECT_NE(message.find(why), std::string::npos) << message;
  };
  refused("index.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 9\n");
  refused("empty.obj", "");
  refused("goes_on.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 \\\n3\n", "line 4 goes on");
  refused("zero.obj", std::string("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n") + '\0', "line 5 has a byte 0");
  refused("nan.off", "OFF\n3 1 0\n0 0 nan\n1 0 0\n0 1 0\n3 0 1 2\n");
  refused("words.stl", "this is no surface");
  refused("words.vtp", "this is no surface");
  refused("a.step", "");
}

}  // namespace test_surface
