// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/equilibrium/equilibrium.h"

#include <fmt/format.h>

#include "equilibrium/local_level.h"
#include "equilibrium/nested_iteration.h"
#include "hexmesh/core/error.h"
#include "level/grading.h"
#include "level/islands.h"
#include "level/make_result.h"
#include "match/rigid_alignment.h"
#include "mesh/points.h"

namespace hexsolver {

using hexmesh::Lattice;

int finest_level(const Scene& scene, const Lattice& lattice) { return finest_level(scene, cells_of_levels(lattice)); }

int finest_level(const Scene& scene, const std::vector<std::size_t>& num_cells) {
  constexpr std::size_t default_most_cells = 20000;
  const int count = static_cast<int>(num_cells.size());
  if (scene.level) {
    if (*scene.level >= count)
      throw hexmesh::Error(hexmesh::ErrorKind::input,
                           fmt::format("solve.level is {}, expected 0 to {}", *scene.level, count - 1));
    return *scene.level;
  }
  if (scene.is_open_ended()) return 0;
  for (int level = 0; level < count; ++level)
    if (num_cells[static_cast<std::size_t>(level)] <= default_most_cells) return level;
  return count - 1;
}

int finest_level_needed(const Scene& scene, const std::vector<std::size_t>& num_cells, int level) {
  if (level == 0 || scene.dynamics || scene.is_open_ended()) return level;
  // Graded cells are far fewer than those of the level, which are counted where nothing is known of them yet.
  const std::size_t most = scene.is_graded() ? 8 * most_cells_looked_at : most_cells_looked_at;
  const bool looks =
      scene.error_estimation == ErrorEstimation::look ||
      (scene.error_estimation == ErrorEstimation::automatic && num_cells[static_cast<std::size_t>(level) - 1] <= most);
  return looks ? level - 1 : level;
}

bool leaves_islands_out(const Lattice& lattice, const Scene& scene, int level) {
  return !islands_to_leave_out(lattice, scene, level).empty();
}

Outcome solve_equilibrium(const Lattice& whole, const Scene& as_written, int level, const SolveProgress& progress,
                          const std::vector<Vec3>* start) {
  SolveReport report;
  const Matchings matchings = make_matchings(as_written, whole);
  const Scene scene = placed(as_written, matchings);
  report.warnings = check_single_points(scene);
  check_contrast(whole);
  check_open_ended(scene, cells_of_levels(whole), level);
  report.effects = list_effects(scene);
  report.elasticity = scene.elasticity;
  const std::optional<Lattice> rest = without_islands(whole, scene, level, report.dropped_cells);
  const Lattice& lattice = rest ? *rest : whole;
  if (rest) warn_of_dropped_cells(whole, level, report);
  NestedIteration<LocalLevel>::Levels levels;
  levels.num_cells = cells_of_levels(lattice, scene);
  levels.looks_beyond_graded = cells_beyond(lattice, scene, level) > 0;
  for (const hexmesh::Level& l : lattice.levels) levels.mixture.push_back(l.mixture);
  while (levels.num_cells[static_cast<std::size_t>(levels.finest_there_is)] == 0) ++levels.finest_there_is;
  NodeVector begin;
  if (start) {
    begin = to_field(*start);
    levels.start = &begin;
  }
  levels.make = [&](int n, const Scene& of_level) {
    return std::make_unique<LocalLevel>(lattice, of_level, n, matchings);
  };
  Solved<LocalLevel> solved = NestedIteration<LocalLevel>(levels, scene, level, report, progress).run();
  solved.level->set_progress({solved.state.load_fraction});
  const LevelProblem& problem = solved.level->problem();
  report.bytes = {{"lattice", hexmesh::bytes_of(lattice)},
                  {"meshes", problem.hierarchy().bytes()},
                  {"multigrid", solved.state.newton.preconditioner_bytes}};
  Outcome outcome = make_result(lattice, problem, solved.state.u, std::move(report));
  outcome.result.labels = whole.labels;  // with the islands that were left out
  return outcome;
}

}  // namespace hexsolver
