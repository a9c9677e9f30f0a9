// SPDX-License-Identifier: Apache-2.0
#include "mesh/hierarchy.h"

#include "hexmesh/core/bytes.h"

namespace hexsolver {
Hierarchy::Hierarchy(Mesh finest, const Vec3& corner, std::size_t coarsest_dofs) : Hierarchy(std::move(finest)) {
  add_coarser(corner, coarsest_dofs);
}

Hierarchy::Hierarchy(const MeshCells& cells, std::size_t coarsest_dofs) : Hierarchy(cells.make_mesh()) {
  MeshCells fine = cells;
  while (meshes.back().is_graded() && meshes.back().num_dofs() > coarsest_dofs) {
    MeshCells coarse = fine.coarser();
    push_coarser(coarse.make_mesh(), merge_into(fine, coarse));
    fine = std::move(coarse);
  }
  if (!meshes.back().is_graded()) add_coarser(cells.lattice().corner(), coarsest_dofs);
}

void Hierarchy::add_coarser(const Vec3& corner, std::size_t coarsest_dofs) {
  while (meshes.back().num_dofs() > coarsest_dofs) {
    const Mesh& fine = meshes.back();
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
