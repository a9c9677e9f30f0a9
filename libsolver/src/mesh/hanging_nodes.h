// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "hexmesh/core/grid.h"
#include "hexmesh/lattice/nodes.h"

namespace hexsolver {

/// Cells of a mesh that are of one size, one after the other.
struct CellsOfSize {
  std::size_t first = 0;             ///< number of the first
  hexmesh::Index3 size = {1, 1, 1};  ///< of a cell, in edges of the finest
  hexmesh::Mat3 edges;               ///< columns = edge vectors of a cell [mm]
};

/// Which of the sizes, finest first, a cell is of.
inline std::size_t size_of(std::size_t cell, std::span<const CellsOfSize> sizes) noexcept {
  std::size_t s = sizes.size() - 1;
  while (sizes[s].first > cell) --s;
  return s;
}

/// Behind the last cell of a size.
inline std::size_t end_of_size(std::size_t size, std::size_t num_cells, std::span<const CellsOfSize> sizes) noexcept {
  return size + 1 < sizes.size() ? sizes[size + 1].first : num_cells;
}

/// The free nodes that a node hangs on, with their weights, which sum up to 1.
using HangingNode = std::vector<std::pair<std::int32_t, double>>;

/// The nodes of cells of several sizes.
struct GradedNumbering {
  hexmesh::NodeNumbering numbering;  ///< free nodes, sorted, then hanging ones, sorted
  std::vector<HangingNode> hanging;
};

/// Which nodes cells have where they are split, so that several stand at an index.
class SplitNodes {
public:
  virtual ~SplitNodes() = default;
  /// Which of the nodes at its index, for cells of its size, the corner of a cell is.
  virtual std::int32_t copy(std::size_t cell, int corner) const = 0;
  /// Whether smaller cells that a cell could be divided into have a node, by its place in edges of the finest cells.
  /// @param copy  which, for cells of the size below
  virtual bool holds(std::size_t cell, const hexmesh::Index3& place, std::int32_t copy) const = 0;
};

/// A corner of a cell is free where it is a corner of all cells that hold it: those that it touches, or of split cells
/// those that would share its node if they were as small. Else it hangs on the corners of the larger one that it is no
/// corner of, by trilinear interpolation.
/// @param cells  those of each size sorted, i fastest
/// @param sizes  finest first; cells that touch differ by one at most
/// @param split  nullptr: each index has one node
GradedNumbering number_graded_nodes(std::span<const hexmesh::Index3> cells, std::span<const CellsOfSize> sizes,
                                    const SplitNodes* split);

/// The cells that cover a place, which counts edges of the finest cells, several where they are split: from the first
/// on and behind the last.
std::pair<std::int32_t, std::int32_t> cells_at(const hexmesh::Index3& place, std::span<const hexmesh::Index3> cells,
                                               std::span<const CellsOfSize> sizes);

/// Where a place is in a cell, [0, 1]^3 inside.
/// @param size  of the cell, in edges of what the place counts
inline hexmesh::Vec3 local_in(const hexmesh::Index3& place, const hexmesh::Index3& cell, const hexmesh::Index3& size) {
  hexmesh::Vec3 out;
  for (std::size_t d = 0; d < 3; ++d)
    out[static_cast<Eigen::Index>(d)] = static_cast<double>(place[d]) / size[d] - cell[d];
  return out;
}

}  // namespace hexsolver
