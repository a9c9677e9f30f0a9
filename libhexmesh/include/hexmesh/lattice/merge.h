// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hexmesh/core/grid.h"

namespace hexmesh {

/// Child cell numbers of one parent by slot (bit d = upper half along axis d); -1 where there is no child.
using Children = std::array<std::int32_t, 8>;

/// The coarser cells that a set of cells merges into.
struct Merge {
  Index3 factor;                   ///< children per parent along each axis, 1 or 2
  std::vector<Index3> parents;     ///< sorted, i fastest
  std::vector<Children> children;  ///< one per parent
};

/// Merge the axes along which a cell is shorter than its longest edge by more than sqrt(2); all axes once it is nearly
/// a cube.
/// @param cell_size  edges of a cell [mm]
Index3 merge_factor(const Vec3& cell_size);

/// @param cells   distinct cells, each index >= 0
/// @param factor  1 or 2 along each axis
Merge merge_cells(std::span<const Index3> cells, const Index3& factor);

}  // namespace hexmesh
