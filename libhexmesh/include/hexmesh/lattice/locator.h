// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "hexmesh/geometry/shape_functions.h"

namespace hexmesh {

/// A point inside a cell: u(p) = H u(q), the trilinear embedding of the paper's eq. (1).
struct Embedding {
  std::int32_t cell = -1;
  Vec3 local = Vec3::Zero();  ///< position in the cell, [0, 1]^3; outside only for points that no cell holds
};

/// How far from the material a point may lie and still move with it [mm].
inline constexpr double embedding_reach = 10;

/// Finds the cell of one level that holds a point.
class CellLocator {
public:
  /// @param voxels           the lattice's box
  /// @param voxels_per_cell  of the level
  /// @param cells            of the level; must outlive the locator
  CellLocator(const Grid& voxels, const Index3& voxels_per_cell, std::span<const Index3> cells);

  /// @param voxel_index  continuous voxel index in the box
  /// The cell that holds the point; else the nearest within two cells or `embedding_reach`, extrapolating; else -1.
  Embedding locate(const Vec3& voxel_index) const;
  Embedding locate_position(const Vec3& position) const { return locate(voxels_.continuous_index(position)); }

  /// The cell of a voxel, -1 if there is none.
  std::int32_t cell_of_voxel(const Index3& voxel) const;

  /// The embedding of a point known to belong to that voxel's cell.
  Embedding in_cell_of_voxel(const Index3& voxel, const Vec3& voxel_index) const;

private:
  std::int32_t cell_at(const Index3& cell) const;
  double distance(const Embedding& e) const;
  Embedding embed(std::int32_t cell, const Vec3& voxel_index) const;

  Grid voxels_;
  Index3 voxels_per_cell_;
  std::span<const Index3> cells_;
  Index3 extent_;                     ///< of the box in cells
  std::vector<std::int32_t> number_;  ///< cell number by position in the box, -1 for none
};

}  // namespace hexmesh
