// SPDX-License-Identifier: Apache-2.0
#include "mesh/hanging_nodes.h"

#include <algorithm>
#include <map>
#include <tuple>
#include <unordered_map>

#include "hexmesh/core/index.h"
#include "hexmesh/core/partition.h"
#include "hexmesh/lattice/split_cells.h"
#include "mesh/mesh.h"

namespace hexsolver {
namespace {

using hexmesh::Index3;

/// Corners of cells, 8 cell + corner, that are one node.
class Corners {
public:
  Corners(std::span<const Index3> cells, std::span<const CellsOfSize> sizes, const SplitNodes* split)
      : cells_(cells), sizes_(sizes), split_(split), same_(8 * cells.size()), hangs_on_(8 * cells.size(), -1) {
    for (const std::size_t corner : join_alike()) join_larger(corner);
    std::vector<std::int32_t> of_node(hangs_on_.size(), -1);
    for (std::size_t n = 0; n < hangs_on_.size(); ++n) {
      std::int32_t& on = of_node[hexmesh::as_size(node(n))];
      on = std::max(on, hangs_on_[n]);
    }
    hangs_on_ = std::move(of_node);
  }

  std::size_t size() const { return hangs_on_.size(); }
  std::int32_t node(std::size_t corner) { return same_.root(static_cast<std::int32_t>(corner)); }
  /// The cell that a node hangs on; -1 if it is free.
  std::int32_t hangs_on(std::int32_t node) const { return hangs_on_[hexmesh::as_size(node)]; }

  /// In edges of the finest cells.
  Index3 place(std::size_t corner) const {
    return hexmesh::first_in(hexmesh::corner_of(cells_[corner / 8], static_cast<int>(corner % 8)),
                             size_of_cell(corner / 8));
  }

  Vec3 local(const Index3& place, std::size_t cell) const { return local_in(place, cells_[cell], size_of_cell(cell)); }

private:
  const Index3& size_of_cell(std::size_t cell) const { return sizes_[size_of(cell, sizes_)].size; }
  std::int32_t copy(std::size_t corner) const {
    return split_ ? split_->copy(corner / 8, static_cast<int>(corner % 8)) : 0;
  }

  /// Those of cells of a size at one index. @returns one of each
  std::vector<std::size_t> join_alike() {
    std::vector<std::size_t> first;
    std::vector<std::tuple<std::uint64_t, std::size_t, std::int32_t, std::int32_t>> order;
    for (std::size_t n = 0; n < size(); ++n)
      order.emplace_back(hexmesh::sort_key(place(n)), size_of(n / 8, sizes_), copy(n), static_cast<std::int32_t>(n));
    std::sort(order.begin(), order.end());
    for (std::size_t n = 0; n < order.size(); ++n) {
      const auto& [key, of_size, of_copy, corner] = order[n];
      const auto& [last_key, last_size, last_copy, last] = order[n > 0 ? n - 1 : 0];
      if (n > 0 && std::tie(key, of_size, of_copy) == std::tie(last_key, last_size, last_copy))
        same_.join(corner, last);
      else
        first.push_back(hexmesh::as_size(corner));
    }
    return first;
  }

  /// With larger cells that hold it.
  void join_larger(std::size_t corner) {
    const std::size_t size = size_of(corner / 8, sizes_);
    const Index3 at = place(corner);
    for (int around = 0; around < 8; ++around) {
      Index3 beside = at;
      for (int d = 0; d < 3; ++d) beside[static_cast<std::size_t>(d)] -= hexmesh::corner_bit(around, d);
      const auto [first, end] = cells_at(beside, cells_, sizes_);
      for (std::int32_t other = first; other < end; ++other) {
        const auto larger = hexmesh::as_size(other);
        if (size_of(larger, sizes_) <= size || (split_ && !split_->holds(larger, at, copy(corner)))) continue;
        const Vec3 in = local(at, larger);
        if ((in.array() == 0 || in.array() == 1).all())
          same_.join(static_cast<std::int32_t>(corner), 8 * other + (in[0] == 1) + 2 * (in[1] == 1) + 4 * (in[2] == 1));
        else
          hangs_on_[corner] = std::max(hangs_on_[corner], other);
      }
    }
  }

  std::span<const Index3> cells_;
  std::span<const CellsOfSize> sizes_;
  const SplitNodes* split_;
  hexmesh::Partition same_;
  std::vector<std::int32_t> hangs_on_;  ///< of corners, then of nodes
};

/// What each node hangs on, found once.
class Hangings {
public:
  explicit Hangings(Corners& corners) : corners_(corners) {}

  /// Of free nodes.
  const std::map<std::int32_t, double>& of(std::int32_t node) {
    std::map<std::int32_t, double>& out = known_[node];
    if (!out.empty()) return out;
    const std::int32_t cell = corners_.hangs_on(node);
    if (cell < 0) {
      out[node] = 1;
      return out;
    }
    const NodeWeights weights =
        hexmesh::shape_functions(corners_.local(corners_.place(hexmesh::as_size(node)), hexmesh::as_size(cell)));
    for (std::size_t a = 0; a < 8; ++a) {
      const double weight = weights[static_cast<Eigen::Index>(a)];
      if (weight == 0) continue;
      for (const auto& [n, w] : of(corners_.node(8 * hexmesh::as_size(cell) + a))) out[n] += weight * w;
    }
    return out;
  }

private:
  Corners& corners_;
  std::unordered_map<std::int32_t, std::map<std::int32_t, double>> known_;
};

}  // namespace

std::pair<std::int32_t, std::int32_t> cells_at(const Index3& place, std::span<const Index3> cells,
                                               std::span<const CellsOfSize> sizes) {
  if (*std::min_element(place.begin(), place.end()) < 0) return {0, 0};
  for (std::size_t s = 0; s < sizes.size(); ++s) {
    const std::size_t begin = sizes[s].first;
    const auto [first, end] = hexmesh::cells_at(cells.subspan(begin, end_of_size(s, cells.size(), sizes) - begin),
                                                hexmesh::coarser_index(place, sizes[s].size));
    if (first < end) return {first + static_cast<std::int32_t>(begin), end + static_cast<std::int32_t>(begin)};
  }
  return {0, 0};
}

GradedNumbering number_graded_nodes(std::span<const Index3> cells, std::span<const CellsOfSize> sizes,
                                    const SplitNodes* split) {
  Corners corners(cells, sizes, split);
  std::vector<std::pair<std::uint64_t, std::int32_t>> nodes;  // by place
  for (std::size_t n = 0; n < corners.size(); ++n)
    if (corners.node(n) == static_cast<std::int32_t>(n))
      nodes.emplace_back(hexmesh::sort_key(corners.place(n)), static_cast<std::int32_t>(n));
  std::sort(nodes.begin(), nodes.end());
  std::stable_partition(nodes.begin(), nodes.end(), [&](const auto& n) { return corners.hangs_on(n.second) < 0; });

  GradedNumbering out;
  std::vector<std::int32_t> number(corners.size());
  for (const auto& [key, node] : nodes) {
    number[hexmesh::as_size(node)] = static_cast<std::int32_t>(out.numbering.nodes.size());
    out.numbering.nodes.push_back(corners.place(hexmesh::as_size(node)));
  }
  Hangings hangings(corners);
  for (const auto& [key, node] : nodes) {
    if (corners.hangs_on(node) < 0) continue;
    HangingNode& hanging = out.hanging.emplace_back();
    for (const auto& [on, weight] : hangings.of(node)) hanging.emplace_back(number[hexmesh::as_size(on)], weight);
    std::sort(hanging.begin(), hanging.end());
  }
  out.numbering.cell_nodes.resize(cells.size());
  for (std::size_t n = 0; n < corners.size(); ++n)
    out.numbering.cell_nodes[n / 8][n % 8] = number[hexmesh::as_size(corners.node(n))];
  return out;
}

}  // namespace hexsolver
