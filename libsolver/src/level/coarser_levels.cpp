// SPDX-License-Identifier: Apache-2.0
#include "level/coarser_levels.h"

namespace hexsolver {

std::vector<std::size_t> cells_of_levels(const hexmesh::Lattice& lattice) {
  std::vector<std::size_t> num_cells;
  for (const hexmesh::Level& level : lattice.levels) num_cells.push_back(level.cells.size());
  return num_cells;
}

Scene for_coarser_levels(Scene scene) {
  const auto by_faces = [](Selection& s) {
    if (s.on == SurfacePoints::nodes) s.on = SurfacePoints::faces;
  };
  for (Condition& c : scene.conditions) by_faces(c.selection);
  for (Force& f : scene.forces) by_faces(f.selection);
  return scene;
}

int first_nested_level(const std::vector<std::size_t>& num_cells, int finest) {
  constexpr std::size_t least_cells = 8;
  int first = finest;
  for (int coarser = finest + 1; coarser < static_cast<int>(num_cells.size()); ++coarser)
    if (num_cells[static_cast<std::size_t>(coarser)] >= least_cells) first = coarser;
  return first;
}

}  // namespace hexsolver
