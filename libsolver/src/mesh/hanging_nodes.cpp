// SPDX-License-Identifier: Apache-2.0
#include "mesh/hanging_nodes.h"

#include <algorithm>
#include <map>

#include "hexmesh/core/index.h"
#include "mesh/mesh.h"

namespace hexsolver {
namespace {

using hexmesh::Index3;

Index3 corner_in_finest(const Index3& cell, const Index3& size, int a) {
  const Index3 c = hexmesh::corner_of(cell, a);
  return {c[0] * size[0], c[1] * size[1], c[2] * size[2]};
}

/// What each node hangs on, found once.
class Hangings {
public:
  Hangings(std::span<const Index3> cells, std::span<const CellsOfSize> sizes, const std::vector<Index3>& nodes,
           const std::vector<CellNodes>& cell_nodes)
      : cells_(cells), sizes_(sizes), nodes_(nodes), cell_nodes_(cell_nodes), known_(nodes.size()) {
    for (std::size_t n = 0; n < nodes.size(); ++n) cell_of_.push_back(find_cell(n));
  }

  bool hangs(std::size_t node) const { return cell_of_[node] >= 0; }
  /// Of free nodes by their present numbers.
  const std::map<std::int32_t, double>& of(std::size_t node) {
    std::map<std::int32_t, double>& out = known_[node];
    if (!out.empty()) return out;
    const std::int32_t cell = cell_of_[node];
    if (cell < 0) {
      out[static_cast<std::int32_t>(node)] = 1;
      return out;
    }
    const auto c = static_cast<std::size_t>(cell);
    const Index3& size = sizes_[size_of(c, sizes_)].size;
    Vec3 place;
    for (std::size_t d = 0; d < 3; ++d)
      place[static_cast<Eigen::Index>(d)] = static_cast<double>(nodes_[node][d]) / size[d] - cells_[c][d];
    const NodeWeights weights = hexmesh::shape_functions(place);
    for (std::size_t a = 0; a < 8; ++a) {
      const double weight = weights[static_cast<Eigen::Index>(a)];
      if (weight == 0) continue;
      for (const auto& [n, w] : of(static_cast<std::size_t>(cell_nodes_[c][a]))) out[n] += weight * w;
    }
    return out;
  }

private:
  /// The largest cell that a node touches and is no corner of; -1 if it is free.
  std::int32_t find_cell(std::size_t node) const {
    std::int32_t found = -1;
    for (int a = 0; a < 8; ++a) {
      Index3 place = nodes_[node];
      for (int d = 0; d < 3; ++d) place[static_cast<std::size_t>(d)] -= hexmesh::corner_bit(a, d);
      const std::int32_t cell = cell_at(place, cells_, sizes_);
      if (cell <= found) continue;  // larger cells come later
      const CellNodes& corners = cell_nodes_[static_cast<std::size_t>(cell)];
      if (std::find(corners.begin(), corners.end(), static_cast<std::int32_t>(node)) == corners.end()) found = cell;
    }
    return found;
  }

  std::span<const Index3> cells_;
  std::span<const CellsOfSize> sizes_;
  const std::vector<Index3>& nodes_;
  const std::vector<CellNodes>& cell_nodes_;
  std::vector<std::int32_t> cell_of_;  ///< that a node hangs on
  std::vector<std::map<std::int32_t, double>> known_;
};

}  // namespace

std::int32_t cell_at(const Index3& place, std::span<const Index3> cells, std::span<const CellsOfSize> sizes) {
  if (*std::min_element(place.begin(), place.end()) < 0) return -1;
  for (std::size_t s = 0; s < sizes.size(); ++s) {
    const Index3 index = hexmesh::coarser_index(place, sizes[s].size);
    const auto begin = cells.begin() + static_cast<std::ptrdiff_t>(sizes[s].first);
    const auto end = cells.begin() + static_cast<std::ptrdiff_t>(end_of_size(s, cells.size(), sizes));
    const auto found = std::lower_bound(begin, end, index, hexmesh::i_fastest);
    if (found != end && *found == index) return static_cast<std::int32_t>(found - cells.begin());
  }
  return -1;
}

GradedNumbering number_graded_nodes(std::span<const Index3> cells, std::span<const CellsOfSize> sizes) {
  hexmesh::NodeNumbering all{{}, std::vector<CellNodes>(cells.size())};
  const auto place = [&](std::size_t c, int a) { return corner_in_finest(cells[c], sizes[size_of(c, sizes)].size, a); };
  for (std::size_t c = 0; c < cells.size(); ++c)
    for (int a = 0; a < 8; ++a) all.nodes.push_back(place(c, a));
  std::sort(all.nodes.begin(), all.nodes.end(), hexmesh::i_fastest);
  all.nodes.erase(std::unique(all.nodes.begin(), all.nodes.end()), all.nodes.end());
  for (std::size_t c = 0; c < cells.size(); ++c)
    for (int a = 0; a < 8; ++a)
      all.cell_nodes[c][static_cast<std::size_t>(a)] = static_cast<std::int32_t>(
          std::lower_bound(all.nodes.begin(), all.nodes.end(), place(c, a), hexmesh::i_fastest) - all.nodes.begin());

  Hangings hangings(cells, sizes, all.nodes, all.cell_nodes);
  std::vector<std::int32_t> number(all.nodes.size());
  GradedNumbering out;
  std::vector<std::size_t> hanging;
  for (std::size_t n = 0; n < number.size(); ++n) {
    if (hangings.hangs(n)) {
      hanging.push_back(n);
      continue;
    }
    number[n] = static_cast<std::int32_t>(out.numbering.nodes.size());
    out.numbering.nodes.push_back(all.nodes[n]);
  }
  for (const std::size_t n : hanging) {
    number[n] = static_cast<std::int32_t>(out.numbering.nodes.size());
    out.numbering.nodes.push_back(all.nodes[n]);
    HangingNode& node = out.hanging.emplace_back();
    for (const auto& [on, weight] : hangings.of(n)) node.emplace_back(number[static_cast<std::size_t>(on)], weight);
  }
  out.numbering.cell_nodes = std::move(all.cell_nodes);
  for (CellNodes& nodes : out.numbering.cell_nodes)
    for (std::int32_t& n : nodes) n = number[static_cast<std::size_t>(n)];
  return out;
}

}  // namespace hexsolver
