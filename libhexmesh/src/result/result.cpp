// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/result/result.h"

#include "hexmesh/lattice/embedded_points.h"

namespace hexmesh {

CellLocator locator_of(const Result& result) {
  return {result.voxels, result.voxels_per_cell, result.cells, result.owners};
}

Result rest_state(const Lattice& lattice, int number) {
  const Level& level = lattice.level(number);
  NodeNumbering numbering = nodes_of(level);
  Result r{lattice.voxels, lattice.labels, lattice.segments};
  r.level = number;
  r.voxels_per_cell = level.voxels_per_cell;
  r.cells = level.cells;
  r.parting = lattice.parting;
  r.owners = level.split.owners;
  r.cell_nodes = std::move(numbering.cell_nodes);
  const Mat3 edges = lattice.cell_edges(number);
  for (const Index3& n : numbering.nodes) r.nodes.push_back(lattice.corner() + edges * Vec3(n[0], n[1], n[2]));
  r.segment = level.segment;
  for (std::size_t c = 0; c < level.cells.size(); ++c) {
    r.cell_fields["fill"].push_back(level.fill(c));
    r.cell_fields["parts"].push_back(level.parts[c]);
  }
  r.surface = lattice.surface;
  r.surface_of_voxels = lattice.surface_of_voxels;
  r.history = lattice.history;
  return r;
}

void move_surface(Result& r) {
  EmbeddedPoints(locator_of(r), r.cell_nodes, r.surface, r.parting, r.labels)
      .interpolate({r.displacement.empty() ? nullptr : r.displacement.front().data(), 3 * r.displacement.size()},
                   r.surface_displacement);
}

std::vector<Vec3> displacement_from_rest(const Result& result) {
  std::vector<Vec3> out = result.displacement;
  for (std::size_t n = 0; n < out.size(); ++n) out[n] -= result.rest_displacement[n];
  return out;
}

}  // namespace hexmesh
