// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/equilibrium/equilibrium.h"

#include <fmt/format.h>

#include <algorithm>

#include "equilibrium/local_level.h"
#include "equilibrium/nested_iteration.h"
#include "equilibrium/refinement.h"
#include "equilibrium/rest_level.h"
#include "hexmesh/core/error.h"
#include "hexmesh/core/memory.h"
#include "level/grading.h"
#include "level/islands.h"
#include "level/make_result.h"
#include "match/rigid_alignment.h"
#include "mesh/points.h"

namespace hexsolver {

using hexmesh::Lattice;

namespace {

/// Cells that are solved without a thought.
constexpr std::size_t few_cells = 20000;

}  // namespace

int finest_level(const Scene& scene, const Lattice& lattice) { return finest_level(scene, cells_of_levels(lattice)); }

int finest_level(const Scene& scene, const std::vector<std::size_t>& num_cells) {
  const int count = static_cast<int>(num_cells.size());
  if (scene.level) {
    if (*scene.level >= count)
      throw hexmesh::Error(hexmesh::ErrorKind::input,
                           fmt::format("solve.level is {}, expected 0 to {}", *scene.level, count - 1));
    return *scene.level;
  }
  if (scene.is_open_ended()) return 0;
  for (int level = 0; level < count; ++level)
    if (num_cells[static_cast<std::size_t>(level)] <= few_cells) return level;
  return count - 1;
}

int finest_level_needed(const Scene& scene, const std::vector<std::size_t>& num_cells, int level) {
  if (level == 0 || scene.dynamics || scene.is_open_ended()) return level;
  // Graded cells are far fewer than those of the level, which are counted where nothing is known of them yet.
  const std::size_t most = scene.is_graded() ? 8 * most_cells_looked_at : most_cells_looked_at;
  const bool looks =
      scene.error_estimation == ErrorEstimation::look ||
      (scene.error_estimation == ErrorEstimation::automatic && num_cells[static_cast<std::size_t>(level) - 1] <= most);
  if (!looks) return level;
  const auto cells = [&](int n) { return num_cells[static_cast<std::size_t>(n)]; };
  int finest = level - 1;
  while (finest > 0 && !scene.is_graded() && cells(finest) < least_told_from && cells(finest - 1) > 0) --finest;
  return finest;
}

bool leaves_islands_out(const Lattice& lattice, const Scene& scene, int level) {
  return !islands_to_leave_out(lattice, scene, level).empty();
}

namespace {

template <class Level>
using Levels = typename NestedIteration<Level>::Levels;

/// What levels are made of, but for make().
template <class Level>
Levels<Level> describe_levels(const Lattice& lattice, const Scene& scene, int level) {
  Levels<Level> levels;
  levels.num_cells = cells_of_levels(lattice, scene);
  levels.looks_beyond_graded = cells_beyond(lattice, scene, level) > 0;
  levels.averages = averages_of(lattice);
  levels.unseen = unseen_by_cycle(lattice);
  while (levels.num_cells[static_cast<std::size_t>(levels.finest_there_is)] == 0) ++levels.finest_there_is;
  return levels;
}

void add_memory(const Lattice& lattice, const LevelProblem& problem, const NewtonReport& newton, SolveReport& report) {
  report.bytes = {{"lattice", hexmesh::bytes_of(lattice)},
                  {"meshes", problem.hierarchy().bytes()},
                  {"supports", problem.constraints().bytes()},
                  {"multigrid", newton.preconditioner_bytes}};
}

/// @param cells  those of a level, some divided
/// @throws Error{input} where they would take more memory than is left
void expect_memory_for(const MeshCells& cells, const LocalLevel& of) {
  const LevelProblem& problem = of.problem();
  std::size_t bytes = problem.hierarchy().bytes() + problem.constraints().bytes();
  for (const Potential::Cost& cost : problem.potential().costs()) bytes += cost.bytes;
  constexpr double with_multigrid = 2;
  const double growth = static_cast<double>(cells.size()) / static_cast<double>(of.num_cells());
  hexmesh::expect_memory(static_cast<std::size_t>(with_multigrid * growth * static_cast<double>(bytes)),
                         fmt::format("level {} divided into {} cells", of.level(), cells.size()));
}

/// A report with what a scene says before anything is solved.
SolveReport begin_report(const Scene& scene) {
  SolveReport report;
  report.warnings = check_single_points(scene);
  report.effects = list_effects(scene);
  report.elasticity = scene.elasticity;
  return report;
}

Outcome solve_forward(const Lattice& lattice, const Scene& scene, int level, Levels<LocalLevel> levels,
                      SolveReport report, const SolveProgress& progress) {
  Solved<LocalLevel> solved = NestedIteration<LocalLevel>(std::move(levels), scene, level, report, progress).run();
  const LevelProblem& problem = solved.level->problem();
  if (const Progress reached{solved.state.load_fraction}; !(problem.progress() == reached))
    solved.level->set_progress(reached);  // else contacts are as the last step left them
  add_memory(lattice, problem, solved.state.newton, report);
  return make_result(lattice, problem, solved.state.u, std::move(report));
}

/// The body as the lattice shows it, and where it is at rest.
struct Unloaded {
  Outcome scan, rest;
  CellFields scan_fields;  ///< those that loads change
  std::vector<Vec3> to_rest;
  LoadedReport distance;
};

Unloaded find_rest(const Lattice& lattice, const Scene& scene, int level, RestShapes& shapes, SolveReport report,
                   const SolveProgress& progress) {
  Levels<RestLevel> levels = describe_levels<RestLevel>(lattice, scene, level);
  levels.make = [&](int n, const Scene& of_level) { return std::make_unique<RestLevel>(lattice, of_level, n, shapes); };
  Solved<RestLevel> solved = NestedIteration<RestLevel>(std::move(levels), scene, level, report, progress).run();
  if (!report.converged) report.reason = "no shape without load: " + report.reason;
  LevelProblem& problem = solved.level->mutable_problem();
  const NodeVector& to_rest = solved.state.u;
  problem.set_rest(to_rest);
  add_memory(lattice, problem, solved.state.newton, report);
  const ElasticCells::Size size = problem.elastic().size_in_material(to_rest, problem.islands());
  solved.level->set_progress({solved.state.load_fraction});
  Outcome scan = make_result(lattice, problem, NodeVector::Zero(to_rest.size()), report);
  CellFields fields = changing_fields(problem.elastic(), NodeVector::Zero(to_rest.size()), nullptr);
  solved.level->set_progress({0});
  Outcome at_rest = make_result(lattice, problem, to_rest, std::move(report));
  return {
      std::move(scan), std::move(at_rest), std::move(fields), to_points(to_rest), {nullptr, size.mean, size.largest}};
}

/// Put what the lattice shows beside a state.
void add_scan(Unloaded&& unloaded, Outcome& to) {
  if (const std::size_t folded = unloaded.scan.report.inverted_voxels; folded > 0)
    to.report.warnings.push_back(
        fmt::format("{} voxels are inside out at rest: the material there is too soft for its load", folded));
  to.result.rest_displacement = std::move(unloaded.to_rest);
  for (auto& [name, values] : unloaded.scan_fields) to.result.cell_fields["loaded_" + name] = std::move(values);
  to.report.loaded = std::move(unloaded.distance);
  to.report.loaded->scan = std::make_shared<const SolveReport>(std::move(unloaded.scan.report));
}

/// First the shape without load; then, if the scene says so, the equilibrium under other loads from there.
Outcome solve_from_loaded(const Lattice& lattice, const Scene& scene, int level, SolveReport report,
                          const SolveProgress& progress) {
  const Scene loaded = loaded_scene(scene);
  RestShapes shapes;
  SolveReport of_rest = begin_report(loaded);
  of_rest.dropped_cells = report.dropped_cells;
  Unloaded unloaded = find_rest(lattice, loaded, level, shapes, std::move(of_rest), progress);
  const bool goes_on = unloaded.rest.report.converged && acts_after_loaded(scene);
  if (!goes_on) {
    Outcome out = unloaded.rest;
    for (const std::string& warning : report.warnings)
      if (std::find(out.report.warnings.begin(), out.report.warnings.end(), warning) == out.report.warnings.end())
        out.report.warnings.push_back(warning);
    add_scan(std::move(unloaded), out);
    return out;
  }
  Levels<LocalLevel> levels = describe_levels<LocalLevel>(lattice, scene, level);
  levels.finest_there_is = std::max(levels.finest_there_is, shapes.begin()->first);
  levels.make = [&](int n, const Scene& of_level) {
    const auto shape = shapes.find(n);
    if (shape == shapes.end())
      throw hexmesh::Error(hexmesh::ErrorKind::geometry, fmt::format("level {} has no shape without load", n));
    auto made = std::make_unique<LocalLevel>(lattice, of_level, n);
    made->mutable_problem().set_rest(shape->second);
    return made;
  };
  Outcome out = solve_forward(lattice, scene, level, std::move(levels), std::move(report), progress);
  for (Effect& e : out.report.effects)
    if (e.kind == EffectKind::rest_shape) e.seconds = unloaded.scan.report.solve_seconds;
  add_scan(std::move(unloaded), out);
  return out;
}

/// Solves scenes of a body whose lattice shows it at rest.
class FromRest {
public:
  FromRest(const Lattice& lattice, int level, const Matchings& matchings, const SolveProgress& progress)
      : lattice_(lattice), level_(level), matchings_(matchings), progress_(progress) {}

  /// @param report       with what the scene says before anything is solved
  /// @param start        of the finest level; null: from coarser ones
  /// @param least_cells  of a level that keeps an accuracy
  Outcome solve(const Scene& scene, const SolveReport& report, const std::vector<Vec3>* start,
                std::size_t least_cells = least_compared) {
    Levels<LocalLevel> levels = describe_levels<LocalLevel>(lattice_, scene, level_);
    NodeVector begin;
    if (start) {
      begin = to_field(*start);
      levels.start = &begin;
    }
    levels.make = [this](int n, const Scene& of_level) {
      return std::make_unique<LocalLevel>(lattice_, of_level, n, matchings_, shared_);
    };
    levels.least_cells = least_cells;
    bool gives_way = false;
    levels.give_way = [&gives_way] { gives_way = true; };
    if (scene.is_graded()) grade(scene, levels);
    SolveReport in_vain;
    {
      Outcome out = solve_forward(lattice_, scene, level_, std::move(levels), report, progress_);
      if (!gives_way) return out;
      in_vain = std::move(out.report);
    }
    Outcome out = solve(with_cells_alike(scene), report, start, in_vain.levels.back().cells);
    add_before(in_vain, out.report);
    return out;
  }

private:
  /// Cells of an accuracy give way where their error would have to be told from more than are worth while.
  void grade(const Scene& scene, Levels<LocalLevel>& levels) const {
    constexpr std::size_t part_of_finest = 4;
    const std::size_t worth_while =
        std::max(few_cells, lattice_.level(levels.finest_there_is).cells.size() / part_of_finest);
    const auto divided = [this, &scene](const LocalLevel& of, MeshCells cells) {
      expect_memory_for(cells, of);
      return std::make_unique<LocalLevel>(std::move(cells), scene, matchings_, shared_);
    };
    levels.halve = [=, give_way = levels.give_way, &scene](const LocalLevel& of) -> std::unique_ptr<LocalLevel> {
      if (of.level_of_largest() == 0) return nullptr;
      MeshCells halved = of.problem().cells().divided(std::vector<bool>(of.num_cells(), true));
      if (!scene.asks_accuracy() || halved.size() <= worth_while) return divided(of, std::move(halved));
      give_way();
      return nullptr;
    };
    levels.again = [divided](const LocalLevel& of) {
      return divided(of, of.problem().cells().divided(std::vector<bool>(of.num_cells(), false)));
    };
    if (scene.asks_accuracy())
      levels.refine = [&scene, divided](const LocalLevel& of, LocalLevel& halved, const NodeVector& u,
                                        const NodeVector& change, double part) {
        return divided(of, of.problem().cells().divided(find_cells_to_divide(of, halved, u, change, scene, part)));
      };
  }

  static Scene with_cells_alike(Scene scene) {
    scene.keep_cells();
    scene.grading = Grading::off;
    return scene;
  }

  /// What was solved before a report's solution.
  static void add_before(const SolveReport& before, SolveReport& to) {
    to.levels.insert(to.levels.begin(), before.levels.begin(), before.levels.end());
    to.setup_seconds += before.setup_seconds;
    to.solve_seconds += before.solve_seconds;
    for (Effect& e : to.effects)
      for (const Effect& of_before : before.effects)
        if (of_before.kind == e.kind) e.seconds += of_before.seconds;
  }

  const Lattice& lattice_;
  int level_;
  const Matchings& matchings_;
  const SolveProgress& progress_;
  std::shared_ptr<SharedFindings> shared_ = std::make_shared<SharedFindings>();
};

}  // namespace

Outcome solve_equilibrium(const Lattice& whole, const Scene& as_written, int level, const SolveProgress& progress,
                          const std::vector<Vec3>* start) {
  const Matchings matchings = make_matchings(as_written, whole);
  const Scene scene = placed(as_written, matchings);
  SolveReport report = begin_report(scene);
  check_contrast(whole);
  check_open_ended(scene, cells_of_levels(whole), level);
  const std::optional<Lattice> rest = without_islands(whole, scene_at_end(scene), level, report.dropped_cells);
  const Lattice& lattice = rest ? *rest : whole;
  if (rest) warn_of_dropped_cells(whole, level, report);
  Outcome outcome = scene.loaded ? solve_from_loaded(lattice, scene, level, std::move(report), progress)
                                 : FromRest(lattice, level, matchings, progress).solve(scene, report, start);
  outcome.result.labels = whole.labels;  // with the islands that were left out
  return outcome;
}

}  // namespace hexsolver
