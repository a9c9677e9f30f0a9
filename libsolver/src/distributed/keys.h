// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <tuple>
#include <vector>

#include "hexmesh/lattice/lattice.h"
#include "mesh/mesh.h"

namespace hexsolver::mpi {

using hexmesh::Index3;

/// What all processes call a cell or a node of a level: its index in the whole, and which it is of those there.
struct Key {
  Index3 index{};
  std::int32_t number = 0;
  bool operator==(const Key&) const = default;
};

/// The order of cells and nodes in files: i fastest.
inline bool before(const Key& a, const Key& b) {
  return std::tie(a.index[2], a.index[1], a.index[0], a.number) <
         std::tie(b.index[2], b.index[1], b.index[0], b.number);
}

/// Of a key among those sorted by before(); -1: not there.
inline std::int32_t place_of(const std::vector<Key>& sorted, const Key& key) {
  const auto found = std::lower_bound(sorted.begin(), sorted.end(), key, before);
  return found != sorted.end() && *found == key ? static_cast<std::int32_t>(found - sorted.begin()) : -1;
}

inline void make_distinct(std::vector<Key>& keys) {
  std::sort(keys.begin(), keys.end(), before);
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
}

/// Which node at its index each corner of a cell is.
using CornerNumbers = std::array<std::int32_t, hexmesh::num_cell_nodes>;

/// Some cells of a level, with what all processes call them.
struct KeyedCells {
  std::vector<Key> cells;              ///< sorted
  std::vector<CornerNumbers> corners;  ///< of each cell; empty: each index has one node
  std::vector<Key> nodes;              ///< of the mesh, sorted

  CornerNumbers corners_of(std::size_t cell) const { return corners.empty() ? CornerNumbers{} : corners[cell]; }

  /// Their mesh, whose nodes this sets.
  /// @param low, origin  index and position of the mesh's node (0, 0, 0)
  Mesh make_mesh(const Index3& low, const Mat3& edges, const Vec3& origin);
};

/// Those of a lattice, which begins at `low` in the whole.
KeyedCells keyed_cells(const hexmesh::Level& level, const Index3& low);

}  // namespace hexsolver::mpi
