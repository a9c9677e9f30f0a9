// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "hexmesh/lattice/surface_faces.h"
#include "support/bodies.h"

namespace test_surface_faces {

using namespace hexmesh;
using namespace testing_support;

/// More faces than a block has: a ball of 40 voxels across with holes.
Lattice large_ball() {
  return one_material({42, 42, 42}, {1, 0.9, 1.3}, [](const Index3& v) {
    return (Vec3(v[0], v[1], v[2]) - Vec3::Constant(20.5)).norm() < 20 && (v[0] + 42 * v[1] + v[2]) % 97 != 0;
  });
}

TEST(SurfaceFaces, AllAreThereOnceInTheOrderOfTheVoxels) {
  const Lattice lattice = large_ball();
  std::vector<ExposedFace> faces = exposed_faces(lattice);
  ASSERT_GT(faces.size(), 3 * SurfaceFaces::block_size);
  EXPECT_TRUE(std::is_sorted(faces.begin(), faces.end(), by_voxel));
  EXPECT_EQ(std::adjacent_find(faces.begin(), faces.end()), faces.end());
  const auto is_material = [&](const Index3& voxel) {
    return lattice.voxels.contains(voxel) && lattice.labels[lattice.voxels.offset(voxel)] != 0;
  };
  std::size_t expected = 0;
  for (std::size_t n = 0; n < lattice.labels.size(); ++n)
    for (std::size_t side = 0; side < 6 && lattice.labels[n] != 0; ++side) {
      Index3 beside = lattice.voxels.index(n);
      beside[side / 2] += side % 2 ? 1 : -1;
      expected += !is_material(beside);
    }
  EXPECT_EQ(faces.size(), expected);
  std::shuffle(faces.begin(), faces.end(), std::mt19937(1));
  EXPECT_EQ(FacesInMemory(faces).all(), exposed_faces(lattice));
}

TEST(SurfaceFaces, BlocksNearAPlaceHoldAllFacesNearIt) {
  const Lattice lattice = large_ball();
  const std::vector<ExposedFace> faces = exposed_faces(lattice);
  std::mt19937 random(2);
  std::size_t read = 0, all = 0;
  for (int n = 0; n < 50; ++n) {
    const Vec3 place = lattice.voxels.position(face_index(faces[random() % faces.size()]));
    const double radius = 0.5 * (n % 7);
    const std::vector<ExposedFace> near = faces_of(lattice)->find(
        lattice.voxels, [&](const auto& ball) { return (ball.center - place).norm() <= ball.radius + radius; });
    for (const ExposedFace& face : faces) {
      const bool is_near = (lattice.voxels.position(face_index(face)) - place).norm() <= radius;
      EXPECT_TRUE(!is_near || std::binary_search(near.begin(), near.end(), face, by_voxel));
    }
    read += near.size();
    all += faces.size();
  }
  EXPECT_LT(read, all / 2);  // and not much more
}

}  // namespace test_surface_faces
