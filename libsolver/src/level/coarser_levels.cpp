// SPDX-License-Identifier: Apache-2.0
#include "level/coarser_levels.h"

#include <algorithm>
#include <cmath>

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

double expected_seconds(const std::vector<LevelReport>& solved, std::size_t cells) {
  constexpr double least_power = 0.5, most_power = 1.1;
  const LevelReport& last = solved.back();
  const LevelReport& before = solved[solved.size() > 1 ? solved.size() - 2 : 0];
  const auto growth = [](std::size_t to, std::size_t from) {
    return std::log(static_cast<double>(to) / static_cast<double>(from));
  };
  double power = most_power;
  if (before.cells < last.cells)
    power = std::clamp(std::log(last.seconds / before.seconds) / growth(last.cells, before.cells), least_power, power);
  return last.seconds * std::exp(power * growth(cells, last.cells));
}

}  // namespace hexsolver
