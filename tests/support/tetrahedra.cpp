// SPDX-License-Identifier: Apache-2.0
#include "tetrahedra.h"

#include <Eigen/LU>
#include <utility>

namespace testing_support {

hexmesh::TetMesh box_of_tets(const hexmesh::Vec3& size, const hexmesh::Index3& bricks) {
  hexmesh::TetMesh mesh;
  const auto node = [&](const hexmesh::Index3& n) { return n[0] + (bricks[0] + 1) * (n[1] + (bricks[1] + 1) * n[2]); };
  for (int k = 0; k <= bricks[2]; ++k)
    for (int j = 0; j <= bricks[1]; ++j)
      for (int i = 0; i <= bricks[0]; ++i)
        mesh.points.emplace_back(size[0] * i / bricks[0], size[1] * j / bricks[1], size[2] * k / bricks[2]);
  for (int k = 0; k < bricks[2]; ++k)
    for (int j = 0; j < bricks[1]; ++j)
      for (int i = 0; i < bricks[0]; ++i)
        // From the lower corner to the upper one along the axes, in each of their six orders (Kuhn).
        for (const std::array<std::size_t, 3>& order :
             {std::array<std::size_t, 3>{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}) {
          hexmesh::Index3 at = {i, j, k};
          std::array<std::int32_t, 4> tet = {node(at)};
          for (std::size_t n = 0; n < 3; ++n) {
            ++at[order[n]];
            tet[n + 1] = node(at);
          }
          mesh.corners.push_back(tet);
          mesh.segment.push_back(0);
          if (hexmesh::tet_frame(mesh, mesh.size() - 1).determinant() < 0)
            std::swap(mesh.corners.back()[1], mesh.corners.back()[2]);
        }
  return mesh;
}

}  // namespace testing_support
