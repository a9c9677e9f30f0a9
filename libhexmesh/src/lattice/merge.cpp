// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/merge.h"

#include <algorithm>
#include <cmath>

#include "hexmesh/core/partition.h"

namespace hexmesh {
namespace {

bool share_a_node(const CellNodes& a, const CellNodes& b) {
  return std::find_first_of(a.begin(), a.end(), b.begin(), b.end()) != a.end();
}

/// Of each cell, whether it belongs to a part of at most `most` cells.
std::vector<bool> cells_of_small_parts(std::span<const CellNodes> cell_nodes, std::size_t num_nodes, int most) {
  Partition parts(num_nodes);
  for (const CellNodes& nodes : cell_nodes)
    for (const std::int32_t node : nodes) parts.join(nodes[0], node);
  std::vector<int> size(num_nodes);
  for (const CellNodes& nodes : cell_nodes) ++size[as_size(parts.root(nodes[0]))];
  std::vector<bool> out(cell_nodes.size());
  for (std::size_t c = 0; c < out.size(); ++c) out[c] = size[as_size(parts.root(cell_nodes[c][0]))] <= most;
  return out;
}

/// Chains of crumbs alone join that of the first child that is none.
/// @param children  numbers of the children of a parent, behind a key
void join_crumbs(std::span<const std::pair<std::uint64_t, std::int32_t>> children, const std::vector<bool>& is_crumb,
                 Partition& chains) {
  std::int32_t first = -1;
  std::vector<bool> holds_others(children.size());
  for (std::size_t n = 0; n < children.size(); ++n) {
    if (is_crumb[as_size(children[n].second)]) continue;
    if (first < 0) first = static_cast<std::int32_t>(n);
    holds_others[as_size(chains.root(static_cast<std::int32_t>(n)))] = true;
  }
  for (std::int32_t n = 0; first >= 0 && as_size(n) < children.size(); ++n)
    if (!holds_others[as_size(chains.root(n))]) chains.join(first, n);
}

/// @param linked    whether two children of one parent are to be merged
/// @param is_crumb  of each cell; empty: none
template <class Linked>
Merge merge_where(std::span<const Index3> cells, const Index3& factor, const std::vector<bool>& is_crumb,
                  Linked&& linked) {
  const auto parent_of = [&](const Index3& c) { return coarser_index(c, factor); };
  std::vector<std::pair<std::uint64_t, std::int32_t>> order(cells.size());
  for (std::size_t n = 0; n < cells.size(); ++n)
    order[n] = {sort_key(parent_of(cells[n])), static_cast<std::int32_t>(n)};
  std::sort(order.begin(), order.end());

  Merge merge{factor, {}, {}};
  std::vector<std::int32_t> chain;  // of the parents at one index: the first child of the chain that is theirs
  for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    while (end < order.size() && order[end].first == order[begin].first) ++end;
    const std::span children(order.begin() + static_cast<std::ptrdiff_t>(begin), end - begin);
    Partition chains(children.size());
    for (std::size_t b = 1; b < children.size(); ++b)
      for (std::size_t a = 0; a < b; ++a)
        if (linked(children[a].second, children[b].second))
          chains.join(static_cast<std::int32_t>(a), static_cast<std::int32_t>(b));
    if (!is_crumb.empty()) join_crumbs(children, is_crumb, chains);
    chain.clear();
    const std::size_t first_parent = merge.parents.size();
    for (std::size_t n = 0; n < children.size(); ++n) {
      const std::int32_t number = children[n].second, first = chains.root(static_cast<std::int32_t>(n));
      const Index3& child = cells[number];
      std::size_t slot = 0;
      for (std::size_t d = 0; d < 3; ++d) slot |= as_size(child[d] % factor[d]) << d;
      std::size_t p = 0;
      while (p < chain.size() && (chain[p] != first || merge.children[first_parent + p][slot] >= 0)) ++p;
      if (p == chain.size()) {
        chain.push_back(first);
        merge.parents.push_back(parent_of(child));
        merge.children.push_back({-1, -1, -1, -1, -1, -1, -1, -1});
      }
      merge.children[first_parent + p][slot] = number;
    }
  }
  return merge;
}

/// Corners of parents, 8 parent + corner, joined where both parents pass them on to one node.
Partition join_corners(const Merge& merge, std::span<const CellNodes> cell_nodes, std::size_t num_nodes) {
  Partition same(8 * merge.parents.size());
  std::vector<std::int32_t> seen_in(num_nodes, -1);
  for (std::size_t parent = 0; parent < merge.parents.size(); ++parent)
    for (int slot = 0; slot < 8; ++slot) {
      const std::int32_t child = merge.children[parent][slot];
      if (child < 0) continue;
      for (int a = 0; a < 8; ++a) {
        std::int32_t& seen = seen_in[as_size(cell_nodes[child][a])];
        if (seen < 0) seen = static_cast<std::int32_t>(parent);
        if (as_size(seen) == parent) continue;
        const NodeWeights weights = weights_in_parent(slot, a, merge.factor);
        for (int corner = 0; corner < 8; ++corner) {
          if (weights[corner] == 0) continue;
          int in_other = 0;
          for (int d = 0; d < 3; ++d)
            in_other |= (merge.parents[parent][d] + corner_bit(corner, d) - merge.parents[seen][d]) << d;
          same.join(8 * static_cast<std::int32_t>(parent) + corner, 8 * seen + in_other);
        }
      }
    }
  return same;
}

using Corner = std::pair<std::uint64_t, std::int32_t>;  ///< sort key of its index; 8 parent + corner

/// The first corner of each set, i fastest.
std::vector<Corner> nodes_in_order(const Merge& merge, Partition& same) {
  std::vector<Corner> nodes;
  for (std::int32_t n = 0; as_size(n) < 8 * merge.parents.size(); ++n)
    if (same.root(n) == n) nodes.emplace_back(sort_key(corner_of(merge.parents[n / 8], n % 8)), n);
  std::sort(nodes.begin(), nodes.end());
  return nodes;
}

/// Join the corners of parents of small parts with those at their indices, of a larger part if there is one.
/// @param is_small  whether a cell is of a small part
/// @param part      of each cell, that to which it may be tied, -1: any; empty: all to any
void tie_small_parts(const Merge& merge, const std::vector<bool>& is_small, std::span<const std::int32_t> part,
                     std::span<const Corner> nodes, Partition& same) {
  const auto part_of = [&](const Corner& corner) {
    const Children& children = merge.children[corner.second / 8];
    const auto child = std::find_if(children.begin(), children.end(), [](std::int32_t c) { return c >= 0; });
    return part.empty() ? 0 : part[as_size(*child)];
  };
  const auto is_tied = [&](const Corner& corner) {
    const Children& children = merge.children[corner.second / 8];
    return std::all_of(children.begin(), children.end(), [&](std::int32_t c) { return c < 0 || is_small[as_size(c)]; });
  };
  for (auto begin = nodes.begin(), end = begin; begin != nodes.end(); begin = end) {
    end = std::find_if(begin, nodes.end(), [&](const Corner& corner) { return corner.first != begin->first; });
    for (auto corner = begin; corner != end; ++corner) {
      if (!is_tied(*corner)) continue;
      const auto is_its = [&](const Corner& other) {
        return part_of(*corner) < 0 || part_of(other) == part_of(*corner);
      };
      const auto larger =
          std::find_if(begin, end, [&](const Corner& other) { return !is_tied(other) && is_its(other); });
      same.join(corner->second, (larger == end ? std::find_if(begin, end, is_its) : larger)->second);
    }
  }
}

/// @param nodes  the first corner of each set, and of sets that have been joined since
NodeNumbering number_sets(const Merge& merge, std::span<const Corner> nodes, Partition& same) {
  const std::size_t num_corners = 8 * merge.parents.size();
  NodeNumbering out{{}, std::vector<CellNodes>(merge.parents.size())};
  std::vector<std::int32_t> number(num_corners);
  for (const auto& [key, n] : nodes) {
    if (same.root(n) != n) continue;
    number[n] = static_cast<std::int32_t>(out.nodes.size());
    out.nodes.push_back(corner_of(merge.parents[n / 8], n % 8));
  }
  for (std::int32_t n = 0; as_size(n) < num_corners; ++n) out.cell_nodes[n / 8][n % 8] = number[as_size(same.root(n))];
  return out;
}

}  // namespace

Index3 merge_factor(const Vec3& cell_size) {
  Index3 factor = {1, 1, 1};
  for (int d = 0; d < 3; ++d)
    if (cell_size[d] * std::sqrt(2.0) < cell_size.maxCoeff()) factor[d] = 2;
  return factor == Index3{1, 1, 1} ? Index3{2, 2, 2} : factor;
}

Merge merge_cells(std::span<const Index3> cells, const Index3& factor) {
  return merge_where(cells, factor, {}, [](std::int32_t, std::int32_t) { return true; });
}

Merge merge_linked_cells(std::span<const Index3> cells, std::span<const CellNodes> cell_nodes, const Index3& factor,
                         const std::vector<bool>& is_crumb) {
  return merge_where(cells, factor, is_crumb,
                     [&](std::int32_t a, std::int32_t b) { return share_a_node(cell_nodes[a], cell_nodes[b]); });
}

NodeWeights weights_in_parent(int slot, int corner, const Index3& factor) {
  Vec3 place;
  for (int d = 0; d < 3; ++d) place[d] = static_cast<double>(corner_bit(slot, d) + corner_bit(corner, d)) / factor[d];
  return shape_functions(place);
}

NodeNumbering number_linked_parent_nodes(const Merge& merge, std::span<const CellNodes> cell_nodes,
                                         std::size_t num_nodes) {
  Partition same = join_corners(merge, cell_nodes, num_nodes);
  return number_sets(merge, nodes_in_order(merge, same), same);
}

NodeNumbering number_parent_nodes(const Merge& merge, std::span<const CellNodes> cell_nodes, std::size_t num_nodes) {
  return number_parent_nodes(merge, cell_nodes, num_nodes,
                             cells_of_small_parts(cell_nodes, num_nodes, most_cells_tied));
}

NodeNumbering number_parent_nodes(const Merge& merge, std::span<const CellNodes> cell_nodes, std::size_t num_nodes,
                                  const std::vector<bool>& is_small, std::span<const std::int32_t> part) {
  Partition same = join_corners(merge, cell_nodes, num_nodes);
  const std::vector<Corner> nodes = nodes_in_order(merge, same);
  tie_small_parts(merge, is_small, part, nodes, same);
  return number_sets(merge, nodes, same);
}

}  // namespace hexmesh
