// SPDX-License-Identifier: Apache-2.0
#include "distributed/cell_flags.h"

namespace hexsolver::mpi {
namespace {

Eigen::Index axis_of(const Key& cell) { return cell.number % 3; }

}  // namespace

CellFlags::CellFlags(const SharedLevel& level, const std::vector<bool>& of_part)
    : level_(level), flags_(level.make_vector()) {
  const Mesh& mesh = level.mesh();
  NodeVector own = NodeVector::Zero(static_cast<Eigen::Index>(mesh.num_dofs()));
  for (std::size_t c = 0; c < of_part.size(); ++c)
    if (of_part[c]) own[3 * Eigen::Index{mesh.cell_nodes()[c][0]} + axis_of(level.keys().cells[c])] = 1;
  level.copies().raise_to(own, flags_);
}

std::vector<bool> CellFlags::of(const std::vector<Piece::Holder>& cells) const {
  const auto first_node = [](const Piece::Holder& cell) { return Key{cell.cell.index, cell.corners[0]}; };
  std::vector<Key> keys;
  for (const Piece::Holder& cell : cells) keys.push_back(first_node(cell));
  make_distinct(keys);
  NodeVector values;
  NodeCopies(flags_, level_.nodes().find(keys)).get(flags_, values);
  std::vector<bool> out;
  for (const Piece::Holder& cell : cells)
    out.push_back(values[3 * Eigen::Index{place_of(keys, first_node(cell))} + axis_of(cell.cell)] > 0);
  return out;
}

}  // namespace hexsolver::mpi
