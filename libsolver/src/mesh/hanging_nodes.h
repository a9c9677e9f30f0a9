// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "hexmesh/lattice/nodes.h"

namespace hexsolver {

struct CellsOfSize;

/// The free nodes that a node hangs on, with their weights, which sum up to 1.
using HangingNode = std::vector<std::pair<std::int32_t, double>>;

/// The nodes of cells of several sizes.
struct GradedNumbering {
  hexmesh::NodeNumbering numbering;  ///< free nodes, sorted, then hanging ones, sorted
  std::vector<HangingNode> hanging;
};

/// A corner of a cell is free where it is a corner of all cells that it touches. Else it hangs on the corners of the
/// largest that it is no corner of, by trilinear interpolation.
/// @param cells  those of each size sorted, i fastest
/// @param sizes  finest first
GradedNumbering number_graded_nodes(std::span<const hexmesh::Index3> cells, std::span<const CellsOfSize> sizes);

/// The cell that covers a place, which counts edges of the finest cells; -1 if none does.
std::int32_t cell_at(const hexmesh::Index3& place, std::span<const hexmesh::Index3> cells,
                     std::span<const CellsOfSize> sizes);

}  // namespace hexsolver
