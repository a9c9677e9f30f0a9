// SPDX-License-Identifier: Apache-2.0
#include "distributed/parent_nodes.h"

#include <algorithm>
#include <map>

#include "hexmesh/core/partition.h"

namespace hexsolver::mpi {
namespace {

using hexmesh::Merge;
using hexmesh::NodeNumbering;
using hexmesh::sort_key;

std::uint64_t place_in_whole(const Index3& index, const Index3& low) {
  return sort_key({index[0] + low[0], index[1] + low[1], index[2] + low[2]});
}

/// Coarse nodes that pass on to a fine one, in the order of their indices, and -1 for those that are missing.
using Parents = std::array<std::int32_t, 8>;

/// Of the nodes that other processes have too.
std::map<std::int32_t, Parents> parents_of_shared(const Mesh& fine, const Merge& merge, const NodeNumbering& coarse,
                                                  const NodeSubdomain& part) {
  std::map<std::int32_t, Parents> out;
  std::vector<bool> is_shared(fine.num_nodes());
  for (const std::int32_t n : part.shared_nodes()) is_shared[static_cast<std::size_t>(n)] = true;
  for (std::size_t parent = 0; parent < merge.parents.size(); ++parent)
    for (int slot = 0; slot < 8; ++slot) {
      const std::int32_t child = merge.children[parent][slot];
      if (child < 0) continue;
      for (int a = 0; a < 8; ++a) {
        const auto node = fine.node(child, a);
        if (!is_shared[node]) continue;
        const auto [entry, is_new] = out.try_emplace(static_cast<std::int32_t>(node));
        if (!is_new) continue;  // other parents that have it pass on the same
        const NodeWeights weights = hexmesh::weights_in_parent(slot, a, merge.factor);
        Parents& parents = entry->second;
        parents.fill(-1);
        std::size_t count = 0;
        for (int corner = 0; corner < 8; ++corner)
          if (weights[corner] != 0) parents[count++] = coarse.cell_nodes[parent][corner];
      }
    }
  return out;
}

/// Tell names from process to process, by the fine nodes that coarse ones pass on to, until each has the first of all
/// that are one node.
void agree(const Processes& all, const NodeSubdomain& part, const std::map<std::int32_t, Parents>& parents_of,
           std::vector<NodeName>& names) {
  for (bool changes = true; changes;) {
    bool own_changes = false;
    const auto names_at = [&](std::int32_t node) {
      std::array<NodeName, 8> out{};
      const Parents& parents = parents_of.at(node);
      for (std::size_t p = 0; p < 8; ++p)
        if (parents[p] >= 0) out[p] = names[static_cast<std::size_t>(parents[p])];
      return out;
    };
    part.tell<std::array<NodeName, 8>>(names_at, [&](std::int32_t node, const std::array<NodeName, 8>& told) {
      const Parents& parents = parents_of.at(node);
      for (std::size_t p = 0; p < 8; ++p) {
        if (parents[p] < 0) continue;
        NodeName& name = names[static_cast<std::size_t>(parents[p])];
        if (!(told[p] < name)) continue;
        name = told[p];
        own_changes = true;
      }
    });
    changes = all.largest(own_changes ? 1 : 0) > 0;
  }
}

/// Whether a cell belongs to a part of the whole that is tied to what is beside it.
std::vector<bool> cells_tied(const Processes& all, const Mesh& fine, const NodeSubdomain& part) {
  hexmesh::Partition parts(fine.num_nodes());
  for (const CellNodes& nodes : fine.cell_nodes())
    for (const std::int32_t node : nodes) parts.join(nodes[0], node);
  struct Part {
    std::int64_t name, num_cells;
  };
  std::vector<Part> of_root(fine.num_nodes());
  const auto first = static_cast<std::int64_t>(all.sum_before(fine.num_nodes()));
  for (std::size_t n = 0; n < of_root.size(); ++n) of_root[n].name = first + static_cast<std::int64_t>(n);
  for (const CellNodes& nodes : fine.cell_nodes()) ++of_root[static_cast<std::size_t>(parts.root(nodes[0]))].num_cells;
  const auto part_of = [&](std::int32_t node) -> Part& { return of_root[static_cast<std::size_t>(parts.root(node))]; };
  for (bool changes = true; changes;) {
    bool own_changes = false;
    part.tell<std::int64_t>([&](std::int32_t node) { return part_of(node).name; },
                            [&](std::int32_t node, std::int64_t told) {
                              own_changes = own_changes || told < part_of(node).name;
                              part_of(node).name = std::min(part_of(node).name, told);
                            });
    changes = all.largest(own_changes ? 1 : 0) > 0;
  }
  std::vector<Part> own;
  for (const Part& p : of_root)
    if (p.num_cells > 0) own.push_back(p);
  std::map<std::int64_t, std::int64_t> num_cells;
  for (const Part& p : all.gather(own)) num_cells[p.name] += p.num_cells;
  std::vector<bool> out;
  for (const CellNodes& nodes : fine.cell_nodes())
    out.push_back(num_cells.at(part_of(nodes[0]).name) <= hexmesh::most_cells_tied);
  return out;
}

/// What stands at the index of a tied node.
struct AtIndex {
  std::uint64_t place;
  NodeName name;
  bool is_tied;
};

/// Give nodes of small parts the name of the first at their index, of a larger part if there is one.
/// @param is_tied  of each node
void tie_small_parts(const Processes& all, const std::vector<std::uint64_t>& places, const std::vector<bool>& is_tied,
                     std::vector<NodeName>& names) {
  std::vector<std::uint64_t> tied_places;
  for (std::size_t n = 0; n < places.size(); ++n)
    if (is_tied[n]) tied_places.push_back(places[n]);
  tied_places = all.gather(tied_places);
  std::sort(tied_places.begin(), tied_places.end());
  std::vector<AtIndex> own;
  for (std::size_t n = 0; n < places.size(); ++n)
    if (std::binary_search(tied_places.begin(), tied_places.end(), places[n]))
      own.push_back({places[n], names[n], is_tied[n]});
  std::vector<AtIndex> there = all.gather(own);
  std::sort(there.begin(), there.end(),
            [](const AtIndex& a, const AtIndex& b) { return std::tie(a.place, a.name) < std::tie(b.place, b.name); });
  std::map<NodeName, NodeName> name_of_tied;
  for (auto begin = there.begin(), end = begin; begin != there.end(); begin = end) {
    end = std::find_if(begin, there.end(), [&](const AtIndex& a) { return a.place != begin->place; });
    const auto larger = std::find_if_not(begin, end, [](const AtIndex& a) { return a.is_tied; });
    for (auto a = begin; a != end; ++a)
      if (a->is_tied) name_of_tied[a->name] = (larger == end ? begin : larger)->name;
  }
  for (std::size_t n = 0; n < places.size(); ++n)
    if (is_tied[n]) names[n] = name_of_tied.at(names[n]);
}

/// One node for each name, in the order of indices and names.
ParentNodes number_names(const NodeNumbering& nodes, const std::vector<std::uint64_t>& places,
                         const std::vector<NodeName>& names) {
  std::vector<std::size_t> order(names.size());
  for (std::size_t n = 0; n < order.size(); ++n) order[n] = n;
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::tie(places[a], names[a]) < std::tie(places[b], names[b]);
  });
  ParentNodes out;
  std::vector<std::int32_t> number(names.size());
  for (const std::size_t n : order) {
    if (out.names.empty() || out.names.back() != names[n]) {
      out.names.push_back(names[n]);
      out.numbering.nodes.push_back(nodes.nodes[n]);
    }
    number[n] = static_cast<std::int32_t>(out.names.size()) - 1;
  }
  for (const CellNodes& of_cell : nodes.cell_nodes) {
    CellNodes& to = out.numbering.cell_nodes.emplace_back();
    for (std::size_t a = 0; a < 8; ++a) to[a] = number[static_cast<std::size_t>(of_cell[a])];
  }
  return out;
}

}  // namespace

std::vector<NodeName> names_of_parents(const Merge& merge, const Index3& low) {
  std::vector<NodeName> out;
  for (std::size_t p = 0; p < merge.parents.size(); ++p) {
    const bool is_another = p > 0 && merge.parents[p] == merge.parents[p - 1];
    out.push_back({place_in_whole(merge.parents[p], low), is_another ? out.back().number + 1 : 0, 0});
  }
  return out;
}

ParentNodes number_shared_parent_nodes(const Processes& all, const Mesh& fine, const Merge& merge, const Index3& low,
                                       const NodeSubdomain& part) {
  const NodeNumbering nodes = hexmesh::number_linked_parent_nodes(merge, fine.cell_nodes(), fine.num_nodes());
  std::vector<std::uint64_t> places;
  for (const Index3& index : nodes.nodes) places.push_back(place_in_whole(index, low));

  const std::vector<NodeName> of_parents = names_of_parents(merge, low);
  const bool may_tie = merge.factor != Index3{1, 1, 1};  // else this is the fine level, told to all
  const std::vector<bool> cell_is_tied =
      may_tie ? cells_tied(all, fine, part) : std::vector<bool>(fine.num_cells(), false);
  std::vector<NodeName> names(nodes.nodes.size(), NodeName{~std::uint64_t{0}, 0, 0});
  std::vector<bool> is_tied(names.size());
  for (std::size_t p = 0; p < of_parents.size(); ++p) {
    const hexmesh::Children& children = merge.children[p];
    const bool parent_is_tied = cell_is_tied[static_cast<std::size_t>(
        *std::find_if(children.begin(), children.end(), [](std::int32_t c) { return c >= 0; }))];
    for (std::int32_t corner = 0; corner < 8; ++corner) {
      const auto n = static_cast<std::size_t>(nodes.cell_nodes[p][static_cast<std::size_t>(corner)]);
      names[n] = std::min(names[n], {of_parents[p].place, of_parents[p].number, corner});
      is_tied[n] = parent_is_tied;
    }
  }
  agree(all, part, parents_of_shared(fine, merge, nodes, part), names);
  if (may_tie) tie_small_parts(all, places, is_tied, names);
  return number_names(nodes, places, names);
}

}  // namespace hexsolver::mpi
