// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "hexmesh/geometry/shape_functions.h"
#include "hexmesh/lattice/split_cells.h"

namespace hexmesh {

/// A point inside a cell: u(p) = H u(q), the trilinear embedding of the paper's eq. (1).
struct Embedding {
  std::int32_t cell = -1;
  Vec3 local = Vec3::Zero();  ///< position in the cell, [0, 1]^3; outside only for points that no cell holds
};

/// Where a place is in a cell of its own or of another level, as Embedding::local.
/// @param voxel_index  continuous voxel index in the lattice's box
Vec3 local_in_cell(const Vec3& voxel_index, const Index3& cell, const Index3& voxels_per_cell);

/// How far from the material a point may lie and still move with it [mm].
inline constexpr double embedding_reach = 10;

/// Finds the cell of one level that holds a point.
class CellLocator {
public:
  /// @param voxels           the lattice's box
  /// @param voxels_per_cell  of the level
  /// @param cells            of the level; must outlive the locator
  /// @param owners           of voxels where several cells stand at one index; likewise
  CellLocator(const Grid& voxels, const Index3& voxels_per_cell, std::span<const Index3> cells,
              const VoxelOwners& owners);
  /// Of cells each of which has an index for itself.
  CellLocator(const Grid& voxels, const Index3& voxels_per_cell, std::span<const Index3> cells);

  const Grid& voxels() const noexcept { return voxels_; }

  /// @param voxel_index  continuous voxel index in the box
  /// The cell that holds the point; else the nearest within two cells or `embedding_reach`, extrapolating; else -1.
  Embedding locate(const Vec3& voxel_index) const;
  Embedding locate_position(const Vec3& position) const { return locate(voxels_.continuous_index(position)); }

  /// The cell of a voxel, -1 if there is none; for a voxel without material where there are several the nearest one's.
  std::int32_t cell_of_voxel(const Index3& voxel) const;

  /// The embedding of a point known to belong to that voxel's cell.
  Embedding in_cell_of_voxel(const Index3& voxel, const Vec3& voxel_index) const;

private:
  std::int32_t cell_at(const Index3& cell) const;
  /// Of the cells at an index that holds the voxel, or the nearest one that one of them holds.
  std::int32_t choose(std::int32_t cell, const Index3& voxel) const;
  bool shares_index(std::int32_t cell) const {
    return hexmesh::as_size(cell) + 1 < cells_.size() && cells_[cell] == cells_[cell + 1];
  }
  double distance(const Embedding& e) const;
  Embedding embed(std::int32_t cell, const Vec3& voxel_index) const;

  Grid voxels_;
  Index3 voxels_per_cell_;
  std::span<const Index3> cells_;
  const VoxelOwners* owners_ = nullptr;
  Index3 extent_;                     ///< of the box in cells
  std::vector<std::int32_t> number_;  ///< number of the first cell by position in the box, -1 for none
};

}  // namespace hexmesh
