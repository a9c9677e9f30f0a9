// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "hexmesh/geometry/shape_functions.h"

namespace hexmesh {

/// Lattice index of node a of a cell.
Index3 corner_of(const Index3& cell, int a);

/// Numbers for a set of lattice indices, by position in their bounding box.
class IndexMap {
public:
  explicit IndexMap(const Index3& extent) : extent_(extent), number_(count_in(extent), -1) {}
  std::int32_t& operator[](const Index3& i) { return number_[offset_in(extent_, i)]; }
  /// Number the marked entries (>= 0) in order and return their indices.
  std::vector<Index3> enumerate() {
    std::vector<Index3> out;
    std::size_t n = 0;
    Index3 i;
    for (i[2] = 0; i[2] < extent_[2]; ++i[2])
      for (i[1] = 0; i[1] < extent_[1]; ++i[1])
        for (i[0] = 0; i[0] < extent_[0]; ++i[0], ++n)
          if (number_[n] >= 0) {
            number_[n] = static_cast<std::int32_t>(out.size());
            out.push_back(i);
          }
    return out;
  }

private:
  Index3 extent_;
  std::vector<std::int32_t> number_;
};

/// One past the largest index along each axis.
Index3 extent_of(std::span<const Index3> indices);

/// Node numbers of a cell, in the order of shape.h.
using CellNodes = std::array<std::int32_t, num_cell_nodes>;

/// The nodes of the cells of a level.
struct NodeNumbering {
  std::vector<Index3> nodes;          ///< lattice index of each node, sorted, i fastest
  std::vector<CellNodes> cell_nodes;  ///< shape (num_cells)
};

NodeNumbering number_nodes(std::span<const Index3> cells);

/// How many nodes the cells have, without numbering them. @pre sorted, i fastest
std::size_t count_nodes(std::span<const Index3> cells);

}  // namespace hexmesh
