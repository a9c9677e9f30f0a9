// SPDX-License-Identifier: Apache-2.0
#include "distributed/part_hierarchy.h"

#include <algorithm>

#include "distributed/parent_nodes.h"

namespace hexsolver::mpi {
namespace {

using hexmesh::Merge;
using hexmesh::sort_key;

/// A cell of a level that everybody gets.
struct ToldCell {
  Index3 index;                   ///< in the whole
  NodeName name;                  ///< its own, of corner 0
  std::array<NodeName, 8> nodes;  ///< names
};

bool comes_before(const ToldCell& a, const ToldCell& b) { return a.name < b.name; }

struct NodeOfWhole {
  std::uint64_t place;
  NodeName name;
  Index3 index;
};

/// All cells, and the nodes as hexmesh::number_parent_nodes() numbers them.
Mesh make_whole(const std::vector<ToldCell>& cells, const Mat3& edges, const Vec3& corner) {
  std::vector<NodeOfWhole> nodes;
  std::vector<Index3> indices;
  for (const ToldCell& c : cells) {
    indices.push_back(c.index);
    for (int a = 0; a < 8; ++a) {
      const Index3 index = hexmesh::corner_of(c.index, a);
      nodes.push_back({sort_key(index), c.nodes[static_cast<std::size_t>(a)], index});
    }
  }
  const auto order = [](const NodeOfWhole& n) { return std::tie(n.place, n.name); };
  const auto precedes = [&](const NodeOfWhole& a, const NodeOfWhole& b) { return order(a) < order(b); };
  std::sort(nodes.begin(), nodes.end(), precedes);
  nodes.erase(std::unique(nodes.begin(), nodes.end(),
                          [&](const NodeOfWhole& a, const NodeOfWhole& b) { return order(a) == order(b); }),
              nodes.end());
  hexmesh::NodeNumbering numbering;
  for (const NodeOfWhole& n : nodes) numbering.nodes.push_back(n.index);
  for (const ToldCell& c : cells) {
    CellNodes& of_cell = numbering.cell_nodes.emplace_back();
    for (int a = 0; a < 8; ++a) {
      const NodeOfWhole wanted{sort_key(hexmesh::corner_of(c.index, a)), c.nodes[static_cast<std::size_t>(a)], {}};
      of_cell[static_cast<std::size_t>(a)] =
          static_cast<std::int32_t>(std::lower_bound(nodes.begin(), nodes.end(), wanted, precedes) - nodes.begin());
    }
  }
  return Mesh(std::move(indices), std::move(numbering), edges, corner);
}

/// The merge into the cells of all processes, other's without children.
/// @param own  of this process, in the order of merge.parents
Merge merge_into_whole(const Merge& merge, const std::vector<ToldCell>& own, const std::vector<ToldCell>& all,
                       const Index3& low) {
  Merge out{merge.factor, {}, {}};
  constexpr hexmesh::Children none = {-1, -1, -1, -1, -1, -1, -1, -1};
  for (const ToldCell& c : all) {
    out.parents.push_back({c.index[0] - low[0], c.index[1] - low[1], c.index[2] - low[2]});
    const auto found = std::lower_bound(own.begin(), own.end(), c, comes_before);
    const bool is_own = found != own.end() && found->name == c.name;
    out.children.push_back(is_own ? merge.children[static_cast<std::size_t>(found - own.begin())] : none);
  }
  return out;
}

}  // namespace

SharedMerges merges_of_parts(const Vec3& cell_size, std::size_t num_cells, int num_processes) {
  // Their work is done by all; blocks of cells are to be few beside those of a process.
  const std::size_t most_cells = std::max<std::size_t>(2000, 32 * static_cast<std::size_t>(num_processes));
  SharedMerges out;
  Vec3 size = cell_size;
  for (std::size_t num_left = num_cells; out.factors.empty() || num_left > most_cells;) {
    const Index3 factor = hexmesh::merge_factor(size);
    out.factors.push_back(factor);
    for (std::size_t d = 0; d < 3; ++d) {
      size[static_cast<Eigen::Index>(d)] *= factor[d];
      out.block[d] *= factor[d];
      num_left /= static_cast<std::size_t>(factor[d]);
    }
  }
  return out;
}

Hierarchy make_part_hierarchy(const Processes& all, Mesh finest, const std::vector<Key>& keys, Index3 low,
                              const Vec3& corner, const Vec3& whole_corner, const SharedMerges& merges,
                              std::size_t coarsest_dofs) {
  std::vector<NodeName> names;
  for (const Key& key : keys) names.push_back({sort_key(key.index), key.number});
  Hierarchy out(std::move(finest));
  for (const Index3& factor : merges.factors) {
    auto part = std::make_unique<NodeSubdomain>(all, names, low);
    const Mesh& fine = out.meshes.back();
    Merge merge = hexmesh::merge_linked_cells(fine.cells(), fine.cell_nodes(), factor);
    low = hexmesh::coarser_index(low, factor);
    ParentNodes nodes = number_shared_parent_nodes(all, fine, merge, low, *part);
    out.subdomains.push_back(std::move(part));
    const Mat3 edges = coarser_edges(fine, factor);
    if (out.subdomains.size() < merges.factors.size()) {
      names = std::move(nodes.names);
      Mesh coarse(merge.parents, std::move(nodes.numbering), edges, corner);
      out.push_coarser(std::move(coarse), std::move(merge));
      continue;
    }
    std::vector<ToldCell> own;
    const std::vector<NodeName> of_parents = names_of_parents(merge, low);
    for (std::size_t p = 0; p < merge.parents.size(); ++p) {
      const Index3& i = merge.parents[p];
      ToldCell& cell = own.emplace_back(ToldCell{{i[0] + low[0], i[1] + low[1], i[2] + low[2]}, of_parents[p], {}});
      for (std::size_t a = 0; a < 8; ++a)
        cell.nodes[a] = nodes.names[static_cast<std::size_t>(nodes.numbering.cell_nodes[p][a])];
    }
    std::vector<ToldCell> cells = all.gather(own);
    std::sort(cells.begin(), cells.end(), comes_before);
    out.push_coarser(make_whole(cells, edges, whole_corner), merge_into_whole(merge, own, cells, low));
  }
  out.add_coarser(whole_corner, coarsest_dofs);
  return out;
}

}  // namespace hexsolver::mpi
