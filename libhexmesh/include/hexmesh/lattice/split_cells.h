// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "hexmesh/lattice/nodes.h"

namespace hexmesh {

/// What is kept apart where cells would hold it together.
struct Parting {
  /// Across gaps: voxels hold together through the faces they share. Through an edge or a corner alone they do where
  /// faces hold them together close by too, within the 4 x 4 x 4 voxels around, so that the noise of a surface opens
  /// nothing, but an oblique fissure one voxel wide is open; and where parts, which faces do not hold together, meet at
  /// no more than 16 nodes. Parts of at most 8 voxels are no bodies of their own: each moves with one part that it
  /// touches. Crumbs, bodies of less than 1/200 of all voxels that touch nothing, go with what is in their cell.
  bool gaps = false;
  /// Labels of segments that slide along each other: faces between them do not hold. Gaps part too where there are any.
  std::vector<std::pair<std::uint16_t, std::uint16_t>> sliding;

  /// Whether two labels are a pair of those, either way.
  bool slide(std::uint16_t one, std::uint16_t other) const;
  bool any() const noexcept { return gaps || !sliding.empty(); }
  bool operator==(const Parting&) const = default;
};

/// Which cell a voxel is in where several stand at one index.
struct VoxelOwners {
  std::vector<std::int64_t>
      voxels;  ///< offsets in the lattice's box of all voxels with material at such indices, ascending
  std::vector<std::int32_t> cells;  ///< the cell that holds each

  /// The cell that holds a voxel, given by its offset; -1 if it is none of these.
  std::int32_t of(std::int64_t voxel) const;

  bool empty() const noexcept { return voxels.empty(); }
  bool operator==(const VoxelOwners&) const = default;
};

/// How the cells of a level differ from one at each index whose nodes are those of all cells around. Empty: not at all.
struct SplitCells {
  std::vector<std::int64_t> corners;  ///< 8 cell + corner, ascending: those whose node is not the first at its index
  std::vector<std::int32_t> copies;  ///< which it is, from 1; nodes at an index are in the order of their first corners
  VoxelOwners owners;

  bool empty() const noexcept { return corners.empty() && owners.empty(); }
  std::int32_t copy(std::int32_t cell, int corner) const;  ///< of a corner's node
  bool operator==(const SplitCells&) const = default;
};

/// Numbers of the cells at an index, from the first on and behind the last. @pre sorted
std::pair<std::int32_t, std::int32_t> cells_at(std::span<const Index3> cells, const Index3& index);

/// Whether another cell stands at the index of one. @pre sorted
inline bool shares_index(std::span<const Index3> cells, std::size_t c) {
  return (c > 0 && cells[c - 1] == cells[c]) || (c + 1 < cells.size() && cells[c + 1] == cells[c]);
}

/// The nodes of cells, as many at an index as split cells have there.
/// @param cells  sorted, i fastest, several at one index perhaps
NodeNumbering number_nodes(std::span<const Index3> cells, const SplitCells& split);

/// How many those are.
std::size_t count_nodes(std::span<const Index3> cells, const SplitCells& split);

}  // namespace hexmesh
