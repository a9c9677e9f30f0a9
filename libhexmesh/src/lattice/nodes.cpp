// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/nodes.h"

#include <algorithm>

namespace hexmesh {
namespace {

/// Of a few cells in a large box, which a map would be too large for.
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
  constexpr std::size_t most_of_box = 64;  // entries of a map per cell
  if (count_in(extent) / most_of_box > cells.size()) return number_nodes_sorted(cells);
  IndexMap number(extent);
  for (const Index3& c : cells)
    for (int a = 0; a < num_cell_nodes; ++a) number[corner_of(c, a)] = 0;
  NodeNumbering out{number.enumerate(), std::vector<CellNodes>(cells.size())};
  for (std::size_t c = 0; c < cells.size(); ++c)
    for (int a = 0; a < num_cell_nodes; ++a) out.cell_nodes[c][a] = number[corner_of(cells[c], a)];
  return out;
}

}  // namespace hexmesh
