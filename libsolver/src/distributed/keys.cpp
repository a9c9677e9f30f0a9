// SPDX-License-Identifier: Apache-2.0
#include "distributed/keys.h"

namespace hexsolver::mpi {

Mesh KeyedCells::make_mesh(const Index3& low, const Mat3& edges, const Vec3& origin) {
  const auto in_mesh = [&](const Index3& i) { return Index3{i[0] - low[0], i[1] - low[1], i[2] - low[2]}; };
  std::vector<Index3> indices;
  for (const Key& cell : cells) indices.push_back(in_mesh(cell.index));
  hexmesh::NodeNumbering numbering = hexmesh::number_nodes(indices);
  const auto in_whole = [&](const Index3& i, std::int32_t number) {
    return Key{{i[0] + low[0], i[1] + low[1], i[2] + low[2]}, number};
  };
  nodes.clear();
  if (corners.empty()) {
    for (const Index3& node : numbering.nodes) nodes.push_back(in_whole(node, 0));
    return {std::move(indices), std::move(numbering), edges, origin};
  }
  const auto corner = [&](std::size_t cell, int a) {
    return Key{hexmesh::corner_of(cells[cell].index, a), corners[cell][static_cast<std::size_t>(a)]};
  };
  for (std::size_t c = 0; c < cells.size(); ++c)
    for (int a = 0; a < hexmesh::num_cell_nodes; ++a) nodes.push_back(corner(c, a));
  make_distinct(nodes);
  for (std::size_t c = 0; c < cells.size(); ++c)
    for (int a = 0; a < hexmesh::num_cell_nodes; ++a)
      numbering.cell_nodes[c][static_cast<std::size_t>(a)] = place_of(nodes, corner(c, a));
  numbering.nodes.clear();
  for (const Key& node : nodes) numbering.nodes.push_back(in_mesh(node.index));
  return {std::move(indices), std::move(numbering), edges, origin};
}

KeyedCells keyed_cells(const hexmesh::Level& level, const Index3& low) {
  KeyedCells out;
  for (std::size_t c = 0; c < level.cells.size(); ++c) {
    const Index3& i = level.cells[c];
    const bool is_another = c > 0 && level.cells[c - 1] == i;
    out.cells.push_back({{i[0] + low[0], i[1] + low[1], i[2] + low[2]}, is_another ? out.cells.back().number + 1 : 0});
  }
  if (level.split.empty()) return out;
  out.corners.resize(level.cells.size());
  for (std::size_t n = 0; n < level.split.corners.size(); ++n)
    out.corners[static_cast<std::size_t>(level.split.corners[n] / 8)]
               [static_cast<std::size_t>(level.split.corners[n] % 8)] = level.split.copies[n];
  return out;
}

}  // namespace hexsolver::mpi
