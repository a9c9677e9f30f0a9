// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/nodes.h"

#include <algorithm>

namespace hexmesh {
namespace {

/// Whether a map of `entries` would be too large for the cells: a few in a large box.
bool are_sparse(std::size_t entries, std::span<const Index3> cells) {
  constexpr std::size_t most_of_box = 64;  // entries per cell
  return entries / most_of_box > cells.size();
}

NodeNumbering number_nodes_sorted(std::span<const Index3> cells) {
  NodeNumbering out{{}, std::vector<CellNodes>(cells.size())};
  for (const Index3& c : cells)
    for (int a = 0; a < num_cell_nodes; ++a) out.nodes.push_back(corner_of(c, a));
  std::sort(out.nodes.begin(), out.nodes.end(), i_fastest);
  out.nodes.erase(std::unique(out.nodes.begin(), out.nodes.end()), out.nodes.end());
  for (std::size_t c = 0; c < cells.size(); ++c)
    for (int a = 0; a < num_cell_nodes; ++a)
      out.cell_nodes[c][a] = static_cast<std::int32_t>(
          std::lower_bound(out.nodes.begin(), out.nodes.end(), corner_of(cells[c], a), i_fastest) - out.nodes.begin());
  return out;
}

}  // namespace

Index3 corner_of(const Index3& cell, int a) {
  return {cell[0] + corner_bit(a, 0), cell[1] + corner_bit(a, 1), cell[2] + corner_bit(a, 2)};
}

Index3 extent_of(std::span<const Index3> indices) {
  Index3 extent = {0, 0, 0};
  for (const Index3& i : indices)
    for (std::size_t d = 0; d < 3; ++d) extent[d] = std::max(extent[d], i[d] + 1);
  return extent;
}

NodeNumbering number_nodes(std::span<const Index3> cells) {
  Index3 extent = extent_of(cells);
  for (std::int32_t& n : extent) ++n;
  if (are_sparse(count_in(extent), cells)) return number_nodes_sorted(cells);
  IndexMap number(extent);
  for (const Index3& c : cells)
    for (int a = 0; a < num_cell_nodes; ++a) number[corner_of(c, a)] = 0;
  NodeNumbering out{number.enumerate(), std::vector<CellNodes>(cells.size())};
  for (std::size_t c = 0; c < cells.size(); ++c)
    for (int a = 0; a < num_cell_nodes; ++a) out.cell_nodes[c][a] = number[corner_of(cells[c], a)];
  return out;
}

std::size_t count_nodes(std::span<const Index3> cells) {
  const Index3 extent = extent_of(cells);
  const std::size_t row = as_size(extent[0]) + 1, size = row * (as_size(extent[1]) + 1);
  if (are_sparse(size, cells)) return number_nodes_sorted(cells).nodes.size();
  std::vector<std::uint8_t> below(size), above(size);  // nodes of one layer of cells, by their corners
  std::size_t count = 0;
  std::int32_t layer = -1;
  for (const Index3& c : cells) {
    if (c[2] != layer) {
      c[2] == layer + 1 ? below.swap(above) : void(std::fill(below.begin(), below.end(), 0));
      std::fill(above.begin(), above.end(), 0);
      layer = c[2];
    }
    for (int a = 0; a < num_cell_nodes; ++a) {
      std::uint8_t& node =
          (corner_bit(a, 2) ? above : below)[row * as_size(c[1] + corner_bit(a, 1)) + as_size(c[0] + corner_bit(a, 0))];
      count += node == 0;
      node = 1;
    }
  }
  return count;
}

}  // namespace hexmesh
