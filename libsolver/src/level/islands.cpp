// SPDX-License-Identifier: Apache-2.0
#include "level/islands.h"

#include <fmt/format.h>

#include "constraints/select_points.h"
#include "hexmesh/core/error.h"
#include "selection/selection.h"

namespace hexsolver {

using hexmesh::Lattice;

void fail_unsupported(const std::vector<FreePart>& free, const Scene& scene, int level, bool only_islands) {
  std::vector<std::string> motions;
  for (const FreePart& part : free) {
    motions.insert(motions.end(), part.motions.begin(), part.motions.end());
  }
  throw hexmesh::Error(hexmesh::ErrorKind::geometry,
                       missing_supports(motions, level) +
                           (scene.contacts.empty() ? ""
                            : scene.loaded         ? " (contacts hold nothing in [loaded])"
                                                   : " (contacts carry where solve.islands is \"error\")") +
                           (only_islands ? ", or solve.islands = \"drop\" or \"hold\"" : ""));
}

bool is_carried_by_contacts(const Scene& scene) {
  return !scene.contacts.empty() && !scene.dynamics && !scene.loaded && scene.islands == Islands::error;
}

bool only_islands_among(const std::vector<FreePart>& free, const Mesh& mesh) {
  std::size_t cells = 0;
  for (const FreePart& part : free) {
    if (!part.is_island) return false;
    cells += part.cells.size();
  }
  return cells < mesh.num_cells();
}

std::vector<std::int32_t> islands_to_leave_out(const Lattice& lattice, const Scene& scene, int level) {
  if (scene.islands == Islands::error) return {};
  const MeshCells all(lattice, level);
  const Mesh mesh = all.make_mesh();
  Selector selector(all, mesh);
  std::vector<ConstraintPoint> holding = select_points(scene, selector);
  add_matched_points(embed(make_matchings(scene, lattice), selector), holding);
  const std::vector<FreePart> free = free_parts(mesh, holding);
  if (!only_islands_among(free, mesh)) return {};
  std::vector<std::int32_t> cells;
  for (const FreePart& part : free)
    if (scene.islands == Islands::drop || part.hangs) cells.insert(cells.end(), part.cells.begin(), part.cells.end());
  return cells;
}

std::optional<Lattice> without_islands(const Lattice& lattice, const Scene& scene, int level, std::size_t& dropped) {
  const std::vector<std::int32_t> cells = islands_to_leave_out(lattice, scene, level);
  dropped = cells.size();
  if (cells.empty()) return {};
  return hexmesh::without_cells(lattice, level, cells);
}

void warn_of_dropped_cells(const Lattice& whole, int level, SolveReport& report) {
  report.warnings.push_back(fmt::format("{} of {} cells of level {} are left out: nothing holds them",
                                        report.dropped_cells,
                                        whole.levels[static_cast<std::size_t>(level)].cells.size(), level));
}

}  // namespace hexsolver
