// SPDX-License-Identifier: Apache-2.0
#include "mesh/hierarchy.h"

#include <algorithm>
#include <span>

#include "hexmesh/core/bytes.h"

namespace hexsolver {
namespace {

/// The finest cells of a graded mesh merged, among those of the next size where there are any, the others as they are.
std::pair<hexmesh::Merge, Mesh> merge_finest(const Mesh& fine, const Vec3& corner) {
  const Vec3 size = fine.edges().colwise().norm();
  const Index3 factor = hexmesh::merge_factor(size);
  const auto end = static_cast<std::ptrdiff_t>(fine.end_of_size(0));
  const hexmesh::Merge finest =
      hexmesh::merge_cells(std::span(fine.cells().begin(), fine.cells().begin() + end), factor);
  struct Parent {
    Index3 index;
    hexmesh::Children children;
    bool is_kept;
  };
  std::vector<Parent> parents;
  std::vector<CellsOfSize> sizes;
  for (std::size_t p = 0; p < finest.parents.size(); ++p)
    parents.push_back({finest.parents[p], finest.children[p], false});
  const auto begin_size = [&](const Mat3& edges, const Index3& of) {
    sizes.push_back({parents.size(), hexmesh::coarser_index(of, factor), edges});
  };
  begin_size(coarser_edges(fine, factor), factor);
  sizes.back().first = 0;
  for (std::size_t s = 1; s < fine.sizes().size(); ++s) {
    if (fine.sizes()[s].size != factor) begin_size(fine.sizes()[s].edges, fine.sizes()[s].size);
    for (std::size_t c = fine.sizes()[s].first; c < fine.end_of_size(s); ++c)
      parents.push_back({fine.cells()[c], {static_cast<std::int32_t>(c), -1, -1, -1, -1, -1, -1, -1}, true});
    std::sort(parents.begin() + static_cast<std::ptrdiff_t>(sizes.back().first), parents.end(),
              [](const Parent& a, const Parent& b) { return hexmesh::i_fastest(a.index, b.index); });
  }
  hexmesh::Merge merge{factor, {}, {}, {}};
  for (const Parent& p : parents) {
    merge.parents.push_back(p.index);
    merge.children.push_back(p.children);
    merge.is_kept.push_back(p.is_kept);
  }
  Mesh coarse(merge.parents, std::move(sizes), corner);
  return {std::move(merge), std::move(coarse)};
}

}  // namespace

Hierarchy::Hierarchy(Mesh finest, const Vec3& corner, std::size_t coarsest_dofs) : Hierarchy(std::move(finest)) {
  add_coarser(corner, coarsest_dofs);
}

void Hierarchy::add_coarser(const Vec3& corner, std::size_t coarsest_dofs) {
  while (meshes.back().num_dofs() > coarsest_dofs) {
    const Mesh& fine = meshes.back();
    if (fine.is_graded()) {
      auto [merge, coarse] = merge_finest(fine, corner);
      push_coarser(std::move(coarse), std::move(merge));
      continue;
    }
    const Vec3 size = fine.edges().colwise().norm();
    hexmesh::Merge merge = hexmesh::merge_linked_cells(fine.cells(), fine.cell_nodes(), hexmesh::merge_factor(size));
    Mesh coarse(merge.parents, hexmesh::number_parent_nodes(merge, fine.cell_nodes(), fine.num_nodes()),
                coarser_edges(fine, merge.factor), corner);
    if (coarse.num_nodes() >= fine.num_nodes()) break;
    push_coarser(std::move(coarse), std::move(merge));
  }
}

void Hierarchy::push_coarser(Mesh coarse, hexmesh::Merge merge) {
  prolongations.emplace_back(meshes.back(), coarse, merge);
  merges.push_back(std::move(merge));
  meshes.push_back(std::move(coarse));
}

std::size_t Hierarchy::bytes() const {
  std::size_t sum = 0;
  for (const Mesh& m : meshes) sum += m.bytes();
  for (const hexmesh::Merge& m : merges) sum += hexmesh::bytes_of(m.parents) + hexmesh::bytes_of(m.children);
  for (const Prolongation& p : prolongations) sum += p.bytes();
  return sum;
}

}  // namespace hexsolver
