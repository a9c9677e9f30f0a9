// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hexmesh/lattice/nodes.h"

namespace hexmesh {

/// Child cell numbers of one parent by slot (bit d = upper half along axis d); -1 where there is no child.
using Children = std::array<std::int32_t, 8>;

/// The coarser cells that a set of cells merges into.
struct Merge {
  Index3 factor;                   ///< children per parent along each axis, 1 or 2
  std::vector<Index3> parents;     ///< sorted, i fastest
  std::vector<Children> children;  ///< one per parent
  std::vector<bool> is_kept;       ///< parents that are a cell as it is, their child in slot 0; empty: none

  Index3 factor_of(std::size_t parent) const { return is_kept.empty() || !is_kept[parent] ? factor : Index3{1, 1, 1}; }
};

/// Merge the axes along which a cell is shorter than its longest edge by more than sqrt(2); all axes once it is nearly
/// a cube.
/// @param cell_size  edges of a cell [mm]
Index3 merge_factor(const Vec3& cell_size);

/// @param cells   distinct cells, each index >= 0
/// @param factor  1 or 2 along each axis
Merge merge_cells(std::span<const Index3> cells, const Index3& factor);

/// Merge cells, which may stand several at one index, as the nodes they share hold them together: children of a parent
/// that no chain of shared nodes links, or that stand at one index, become parents of their own at its index. So a gap
/// stays open in the parents.
/// Source: Nesme, Kry, Jerabkova and Faure, Preserving topology and elasticity for embedded deformable models (2009).
/// @param cells       sorted, i fastest
/// @param cell_nodes  nodes of each cell
/// @param is_crumb    of each cell, whether it goes with others of its parent even if nothing links it; empty: none
Merge merge_linked_cells(std::span<const Index3> cells, std::span<const CellNodes> cell_nodes, const Index3& factor,
                         const std::vector<bool>& is_crumb = {});

inline constexpr int most_cells_tied = 8;

/// Nodes for the parents of linked cells: parents share a node where both pass it on to a node that cells of both hang
/// on. Interpolation in parents then agrees at every shared node of the cells, and nothing else is tied but parts of at
/// most `most_cells_tied` cells to what is beside them: alone in ever larger parents they would leave these without
/// stiffness.
/// @param num_nodes  of the cells
NodeNumbering number_parent_nodes(const Merge& merge, std::span<const CellNodes> cell_nodes, std::size_t num_nodes);

/// The same with the cells named that are of parts to be tied.
/// @param part  of each cell, so that it is tied to cells of its own alone, -1: to any; empty: all to any
NodeNumbering number_parent_nodes(const Merge& merge, std::span<const CellNodes> cell_nodes, std::size_t num_nodes,
                                  const std::vector<bool>& is_small, std::span<const std::int32_t> part = {});

/// The same, but nothing tied: what follows from the links of a part of all cells.
NodeNumbering number_linked_parent_nodes(const Merge& merge, std::span<const CellNodes> cell_nodes,
                                         std::size_t num_nodes);

/// The slot of a child in its parent, by its index.
constexpr int slot_in_parent(const Index3& child, const Index3& factor) {
  int slot = 0;
  for (std::size_t d = 0; d < 3; ++d) slot |= (child[d] % factor[d]) << d;
  return slot;
}

/// Weights of the nodes of a parent at node `corner` of its child in `slot`.
NodeWeights weights_in_parent(int slot, int corner, const Index3& factor);

}  // namespace hexmesh
