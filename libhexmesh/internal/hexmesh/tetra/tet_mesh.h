// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "hexmesh/core/grid.h"

namespace hexmesh {

/// Tetrahedra with straight edges, of 4 or 10 nodes: what lattices are compared with.
struct TetMesh {
  std::vector<Vec3> points;                          ///< [mm], LPS
  std::vector<std::array<std::int32_t, 4>> corners;  ///< of each tetrahedron; positive volume
  /// Nodes half way along the edges 01 12 20 03 13 23 (the order of VTK and Abaqus); empty for 4 nodes.
  std::vector<std::array<std::int32_t, 6>> middles;
  std::vector<std::uint16_t> segment;  ///< label of each tetrahedron

  std::size_t size() const noexcept { return corners.size(); }
  bool is_quadratic() const noexcept { return !middles.empty(); }
  int nodes_each() const noexcept { return is_quadratic() ? 10 : 4; }

  std::int32_t node(std::size_t tet, int a) const { return a < 4 ? corners[tet][a] : middles[tet][a - 4]; }
};

/// The corners that each middle node lies between.
inline constexpr std::array<std::array<int, 2>, 6> tet_edges = {{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}};

/// Six times the volume of a tetrahedron is the determinant of this: columns = edges from corner 0 [mm].
Mat3 tet_frame(const TetMesh& mesh, std::size_t tet);

double volume(const TetMesh& mesh);  ///< [mm^3]

/// The same tetrahedra with 10 nodes each.
TetMesh quadratic(TetMesh linear);

/// Faces with a tetrahedron on one side only, counter-clockwise seen from outside; corner nodes.
std::vector<std::array<std::int32_t, 3>> boundary_triangles(const TetMesh& mesh);

/// Which nodes lie on boundary_triangles().
std::vector<bool> surface_nodes(const TetMesh& mesh);

/// Shape functions of the nodes of a tetrahedron at barycentric coordinates b; those of 4 nodes are b itself.
/// @param out  of nodes_each() values
void tet_shape_functions(const Eigen::Vector4d& b, bool is_quadratic, double* out);

/// Displacements at any point, from those of the nodes.
class TetField {
public:
  /// @param mesh  must outlive this
  explicit TetField(const TetMesh& mesh);

  /// Of the tetrahedron that holds the point, else of the one nearest to holding it among those around, extrapolating.
  Vec3 at(const Vec3& position, const std::vector<Vec3>& displacement) const;

private:
  struct Place {
    std::size_t tet = 0;
    Eigen::Vector4d weights;
  };
  Place locate(const Vec3& position) const;
  Index3 bin_of(const Vec3& position) const;

  const TetMesh& mesh_;
  std::vector<Mat3> inverse_;  ///< of tet_frame()
  Vec3 lower_;
  double edge_ = 1;                            ///< of a bin [mm]
  Index3 bins_{};                              ///< along each axis
  std::vector<std::vector<std::int32_t>> in_;  ///< tetrahedra whose box meets a bin
};

}  // namespace hexmesh
