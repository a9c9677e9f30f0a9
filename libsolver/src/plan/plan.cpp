// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/plan/plan.h"

#include <algorithm>
#include <cmath>

#include "core/stopwatch.h"
#include "equilibrium/error_estimator.h"
#include "hexmesh/core/error.h"
#include "hexsolver/dynamics/motion.h"
#include "kernels/rotated_cells.h"
#include "level/checks.h"
#include "level/coarser_levels.h"
#include "level/condition_reports.h"
#include "level/grading.h"
#include "level/islands.h"
#include "level/make_result.h"
#include "level/on_level.h"
#include "mesh/points.h"

namespace hexsolver {
namespace {

/// Memory that a level takes for each of its cells, as measured (THEORY.md, "Accuracy").
constexpr double linear_bytes = 900, corotational_bytes = 2100, hyperelastic_bytes = 2600;
constexpr double graded_per_cell = 1100;  ///< fewer of them share matrices, and nodes hang
constexpr double pressures_per_cell = 240;
constexpr double reshaped_per_cell = 13000;  ///< each cell has a model of its own, and points
constexpr double saved_per_cell = sizeof(RotatedCells<double>) / double(RotatedCells<double>::lanes);

bool needs_braess_sarazin(const hexmesh::Lattice& lattice, const Scene& scene) {
  double largest = 0;
  for (const hexmesh::VoxelMaterial& m : lattice.materials)
    largest = std::max(largest, m.material.bulk_modulus() / m.material.shear_modulus());
  return scene.volumetric == Volumetric::mean && !is_hyperelastic(scene.elasticity) &&
         Multigrid::needs_braess_sarazin(largest);
}

double usual_bytes(Elasticity elasticity) {
  if (is_hyperelastic(elasticity)) return hyperelastic_bytes;
  return elasticity == Elasticity::cauchy ? linear_bytes : corotational_bytes;
}

bool has_frames(const Scene& scene) {
  return scene.elasticity == Elasticity::corotational && scene.rotation == Rotation::polar;
}

template <class F>
double median_seconds(int repeats, F&& f) {
  std::vector<double> seconds;
  for (int n = 0; n < repeats; ++n) {
    const Stopwatch watch;
    f();
    seconds.push_back(watch.seconds());
  }
  std::nth_element(seconds.begin(), seconds.begin() + repeats / 2, seconds.end());
  return seconds[static_cast<std::size_t>(repeats / 2)];
}

/// The finest of the levels `first` to `last` that has at most that many cells, or `first`.
int finest_of(const std::vector<std::size_t>& num_cells, std::size_t most, int first, int last) {
  int level = first;
  while (level > last && num_cells[static_cast<std::size_t>(level) - 1] <= most) --level;
  return level;
}

/// What a level takes [s].
struct Pace {
  double forming = 0;  ///< to form its elements, from voxels that are as many on each level
  double product = 0;  ///< an operator product, for each cell
};

Pace pace_of(const hexmesh::Lattice& lattice, const Scene& scene, int level) {
  LevelProblem problem(lattice, scene, level);
  const Stopwatch watch;
  problem.build_potential(scene.elasticity);
  Pace pace{watch.seconds()};
  const NodeVector x = NodeVector::Ones(static_cast<Eigen::Index>(problem.mesh().num_dofs()));
  NodeVector y;
  problem.potential().linearize(NodeVector::Zero(x.size()), Hessian::exact);
  pace.product =
      median_seconds(11, [&] { problem.potential().apply(x, y); }) / static_cast<double>(problem.mesh().num_cells());
  return pace;
}

hexmesh::Result preview_of(const LevelProblem& problem) {
  const Scene& scene = problem.scene();
  const Progress end{1, scene.dynamics ? scene.dynamics->duration : 0};
  hexmesh::Result out = hexmesh::rest_state(problem.cells().lattice(), problem.level());
  out.displacement.assign(out.nodes.size(), Vec3::Zero());
  out.load = forces_at_points(problem.load(problem.start()), OnLevel::of(problem.cells(), problem.mesh()).get());
  for (const Condition& c : scene.conditions) out.conditions.push_back({c.name, {}, {}, c.axes});
  const NodeVector rest = NodeVector::Zero(static_cast<Eigen::Index>(problem.mesh().num_dofs()));
  add_condition_points(problem.constraints(), problem.mesh(), rest, out.conditions);
  for (std::size_t c = 0; c < out.conditions.size(); ++c)
    for (std::size_t p = 0; p < out.conditions[c].points.size(); ++p)
      out.conditions[c].displacement[p] =
          prescribed_displacement(scene.conditions[c], out.conditions[c].points[p], end);
  return out;
}

}  // namespace

SceneCheck check_scene(const hexmesh::Lattice& whole, const Scene& as_written, int level, bool with_preview) {
  const Scene scene = scene_at_end(as_written);
  SceneCheck check;
  check.level = level;
  check.warnings = check_single_points(scene);
  check_contrast(whole);
  check_open_ended(scene, cells_of_levels(whole), level);
  const std::optional<hexmesh::Lattice> rest = without_islands(whole, scene, level, check.dropped_cells);
  if (as_written.loaded && acts_after_loaded(as_written)) {
    const Scene loaded = loaded_scene(as_written);
    const LevelProblem on_lattice(rest ? *rest : whole, loaded, level);
    check.warnings = check_level(on_lattice, loaded);
    for (const LevelProblem::LoadTotal& load : on_lattice.loads(on_lattice.start()))
      check.forces.push_back({"loaded." + load.name, load.total});
    for (std::size_t c = 0; c < on_lattice.contacts().size(); ++c) {
      const PenaltyContact::State state = on_lattice.contacts()[c]->state(on_lattice.start());
      check.contacts.push_back(
          {"loaded." + loaded.contacts[c].name, state.points, state.deepest, state.nearest, state.force});
    }
    if (!as_written.loaded->conditions.empty())
      for (ConditionReport& c : report_points(on_lattice.constraints(), loaded)) {
        c.name = "loaded." + c.name;
        check.conditions.push_back(c);
      }
  }
  const LevelProblem problem(rest ? *rest : whole, scene, level);
  if (scene.dynamics) {
    const std::vector<std::string> at_times = Motion(rest ? *rest : whole, scene, level).check();
    check.warnings.insert(check.warnings.end(), at_times.begin(), at_times.end());
  } else {
    const std::vector<std::string> of_level = check_level(problem, scene);
    check.warnings.insert(check.warnings.end(), of_level.begin(), of_level.end());
  }
  for (std::size_t c = 0; c < problem.contacts().size(); ++c) {
    const PenaltyContact::State state = problem.contacts()[c]->state_before(problem.start());
    check.contacts.push_back({scene.contacts[c].name, state.points, state.deepest, state.nearest, state.force});
  }
  std::vector<ConditionReport> conditions = report_points(problem.constraints(), problem.scene());
  check.conditions.insert(check.conditions.begin(), conditions.begin(), conditions.end());
  std::vector<ForceReport> forces;
  for (const LevelProblem::LoadTotal& load : problem.loads(problem.start()))
    forces.push_back({(scene.is_of_lattice ? "loaded." : "") + load.name, load.total});
  check.forces.insert(check.forces.begin(), forces.begin(), forces.end());
  check.held_cells = problem.num_island_cells();
  check.needs_supports = !scene.dynamics;
  check.is_carried = problem.is_carried();
  if (with_preview) check.preview = preview_of(problem);
  return check;
}

namespace {

/// f(level) of the coarsest of the levels `first` to `last` on which it can be: patches may be at odds in coarse cells.
template <class F>
int try_levels(int first, int last, F&& f) {
  for (int level = first;; --level) {
    try {
      f(level);
      return level;
    } catch (const hexmesh::Error& e) {
      if (e.kind() != hexmesh::ErrorKind::geometry || level == last) throw;
    }
  }
}

double growth(const std::vector<std::size_t>& num_cells, int from, int to) {
  return static_cast<double>(num_cells[static_cast<std::size_t>(to)]) /
         static_cast<double>(num_cells[static_cast<std::size_t>(from)]);
}

SolvePlan::Level plan_level(const hexmesh::Lattice& lattice, const Scene& scene, int level, double seconds) {
  const Mesh mesh = cells_for(lattice, scene, level).make_mesh();
  return {level, mesh.num_cells(), mesh.num_dofs(), seconds, expected_bytes(lattice, scene, level)};
}

/// What a level is made of before it is solved.
struct SetUp {
  double seconds = 0;
  std::size_t bytes = 0;  ///< of supports and contacts
};

SetUp set_up(const hexmesh::Lattice& lattice, const Scene& scene, int level) {
  const Stopwatch watch;
  const LevelProblem problem(lattice, scene, level);
  check_level(problem, scene);
  SetUp out{watch.seconds(), problem.constraints().bytes()};
  for (const PenaltyContact* c : problem.contacts()) out.bytes += c->bytes();
  return out;
}

void set_seconds(SolvePlan& plan, EffectKind kind, double seconds) {
  for (Effect& e : plan.effects)
    if (e.kind == kind) e.seconds = seconds;
}

/// The first steps of a level that is quick to step say what one takes.
SolvePlan plan_motion(const hexmesh::Lattice& lattice, const Scene& scene, int level) {
  constexpr std::size_t quick_to_step = 20000;
  constexpr double most_seconds = 2;
  const std::vector<std::size_t> num_cells = cells_of_levels(lattice, scene);
  const int coarsest = static_cast<int>(num_cells.size()) - 1;
  const bool starts_at_rest = scene.dynamics->start.empty();  // else from a result of that level
  const Scene coarse = for_coarser_levels(scene);
  std::optional<Motion> motion;
  const int tried = try_levels(starts_at_rest ? finest_of(num_cells, quick_to_step, coarsest, level) : level, level,
                               [&](int n) { motion.emplace(lattice, n == level ? scene : coarse, n); });
  const Stopwatch of_first;
  motion->step();  // which also sets up what all use
  const double first = of_first.seconds();
  const int some = std::max(1, scene.dynamics->num_steps() / 10);
  const Stopwatch watch;
  std::vector<double> ends = {0};
  while (std::ssize(ends) <= some && ends.back() < most_seconds && motion->step()) ends.push_back(watch.seconds());
  const std::size_t more = ends.size() - 1, half = more / 2;  // later ones take longer, as the body deforms
  const double each = more == 0 ? first : (ends.back() - ends[half]) / static_cast<double>(more - half);
  const double seconds = each * scene.dynamics->num_steps() * growth(num_cells, tried, level);
  SolvePlan plan;
  plan.effects = list_effects(scene);
  plan.levels = {plan_level(lattice, scene, level, seconds)};
  set_seconds(plan, EffectKind::elasticity, seconds);
  return plan;
}

/// The finest level that is quick to solve says what each cell of finer ones takes.
class Trial {
public:
  /// @param finest  that something is asked of
  Trial(const hexmesh::Lattice& lattice, const Scene& scene, int first, int level, int finest)
      : lattice_(lattice), scene_(scene), level_(level), num_cells_(cells_of_levels(lattice, scene)) {
    constexpr std::size_t quick_to_solve = 3000;
    constexpr double most_seconds = 1;
    scene_.error_estimation = ErrorEstimation::off;
    const auto solve_it = [&](int n) {
      tried_ = n;
      solved_ = solve(scene.tolerance);
      if (n == finest) return;
      // Larger levels do not fit into the machine's caches, and have work for all threads.
      constexpr std::size_t quick_to_make = 20000;
      const Scene coarse = for_coarser_levels(scene_);
      const int large = finest_of(num_cells_, quick_to_make, n, level);
      pace_ = pace_of(lattice, coarse, n);
      pace_of_large_ = large == n ? pace_ : pace_of(lattice, coarse, large);
    };
    try_levels(finest_of(num_cells_, quick_to_solve, first, level), level, solve_it);
    while (tried_ > level && to_the_end(tried_ - 1) < most_seconds) try_levels(tried_ - 1, level, solve_it);
  }

  /// Of a level that is solved to the tolerance asked [s].
  double to_the_end(int level) const {
    for (const LevelReport& l : solved_)
      if (l.level == level) return l.seconds;
    return scaled(solved_.back().seconds, level);
  }

  /// Of a level that is a start for others only [s].
  double as_a_start(int level) {
    if (level >= tried_) return to_the_end(level);
    if (!start_) start_ = solve(std::max(scene_.tolerance, nested_tolerance)).back().seconds;
    return scaled(*start_, level);
  }

private:
  /// The levels with the seconds that they take in all.
  std::vector<LevelReport> solve(double tolerance) const {
    Scene scene = tried_ == level_ ? scene_ : for_coarser_levels(scene_);
    scene.name_level(tried_);
    scene.tolerance = tolerance;
    const SolveReport report = solve_equilibrium(lattice_, scene, tried_).report;
    std::vector<LevelReport> levels = report.levels;
    if (!scene.loaded || !acts_after_loaded(scene)) return levels;
    for (LevelReport& level : levels)
      for (const LevelReport& before : report.loaded->scan->levels)
        if (before.level == level.level) level.seconds += before.seconds;
    return levels;
  }
  double scaled(double seconds, int level) const {
    const double solving = std::max(0.0, seconds - pace_.forming) * growth(num_cells_, tried_, level);
    return pace_of_large_.forming + pace_of_large_.product / pace_.product * solving;
  }

  const hexmesh::Lattice& lattice_;
  Scene scene_;
  int level_, tried_ = 0;
  std::vector<std::size_t> num_cells_;
  std::vector<LevelReport> solved_;
  Pace pace_, pace_of_large_;  ///< of the level tried, and of the finest that is quick to make
  std::optional<double> start_;
};

SolvePlan plan_equilibrium(const hexmesh::Lattice& lattice, const Scene& scene, int level) {
  SolvePlan plan;
  const SetUp made = set_up(lattice, scene, level);
  if (!scene.is_open_ended()) plan.setup_seconds = made.seconds;
  plan.effects = list_effects(scene_at_end(scene));
  const std::vector<std::size_t> num_cells = cells_of_levels(lattice, scene);
  const int first = has_friction(scene) ? level : first_nested_level(num_cells, level);
  const int look = scene.is_graded() ? level : finest_level_needed(scene, num_cells, level);
  Trial trial(lattice, scene, first, level, look);
  for (int n = first; n >= level; --n)
    plan.levels.push_back(plan_level(lattice, scene, n, n == level ? trial.to_the_end(n) : trial.as_a_start(n)));
  plan.levels.back().bytes += made.bytes;
  set_seconds(plan, EffectKind::elasticity, plan.seconds());
  if (const std::size_t beyond = cells_beyond(lattice, scene, level); beyond > 0) {
    const double times = static_cast<double>(beyond) / static_cast<double>(num_cells[static_cast<std::size_t>(level)]);
    SolvePlan::Level& looked_at = plan.look.emplace(plan.levels.back());
    looked_at.seconds = times * trial.to_the_end(level);
    looked_at.cells = beyond;
    looked_at.dofs = static_cast<std::size_t>(times * static_cast<double>(looked_at.dofs));
    looked_at.bytes = static_cast<std::size_t>(times * static_cast<double>(looked_at.bytes));
    set_seconds(plan, EffectKind::error_estimate, looked_at.seconds);
  }
  if (look < level && num_cells[static_cast<std::size_t>(look)] > 0) {
    plan.look = plan_level(lattice, scene, look, trial.as_a_start(look));
    set_seconds(plan, EffectKind::error_estimate, plan.look->seconds);
  }
  return plan;
}

}  // namespace

std::size_t expected_bytes(const hexmesh::Lattice& lattice, const Scene& scene, int level) {
  double per_cell = usual_bytes(scene.elasticity);
  if (scene.saves_memory && has_frames(scene)) per_cell -= saved_per_cell;
  if (scene.is_graded()) per_cell += graded_per_cell;
  if (needs_braess_sarazin(lattice, scene)) per_cell += pressures_per_cell;
  if (scene.is_reshaped() && scene.elasticity != Elasticity::cauchy) per_cell += reshaped_per_cell;
  return static_cast<std::size_t>(per_cell * static_cast<double>(cells_for(lattice, scene, level).size()));
}

double SolvePlan::seconds() const {
  double sum = setup_seconds + (look ? look->seconds : 0);
  for (const Level& l : levels) sum += l.seconds;
  return sum;
}

SolvePlan plan_solution(const hexmesh::Lattice& whole, const Scene& asked, int level) {
  Scene scene = asked;
  scene.keep_cells();
  const bool finds_cells = scene.is_graded() && scene.asks_accuracy();
  if (finds_cells) scene.grading = Grading::off;
  std::size_t dropped = 0;
  const std::optional<hexmesh::Lattice> rest = without_islands(whole, scene, level, dropped);
  const hexmesh::Lattice& lattice = rest ? *rest : whole;
  SolvePlan plan = scene.dynamics ? plan_motion(lattice, scene, level) : plan_equilibrium(lattice, scene, level);
  constexpr std::size_t program = 24 << 20;
  const std::size_t beside = plan.look ? plan.look->bytes : plan.levels.size() > 1 ? plan.levels.end()[-2].bytes : 0;
  plan.finds_cells = finds_cells;
  plan.bytes = program + hexmesh::bytes_of(lattice) + plan.levels.back().bytes + beside;
  return plan;
}

SolverTimes measure_solver(const hexmesh::Lattice& lattice, const Scene& scene, int level, int repeats) {
  LevelProblem problem(lattice, scene, level);
  problem.build_potential(scene.elasticity);
  Potential& potential = problem.potential();
  const auto dofs = static_cast<Eigen::Index>(problem.mesh().num_dofs());
  SolverTimes times{problem.mesh().num_cells(), problem.mesh().num_dofs()};
  const NodeVector u = NodeVector::Zero(dofs);
  NodeVector x = NodeVector::LinSpaced(dofs, -1, 1), y;
  problem.constraints().project(x);
  // Far enough from rest that no two linearizations are the same.
  int n = 0;
  const auto linearize_anew = [&](double projection) { potential.linearize(u + 1e-3 * ++n * x, projection); };
  times.project = median_seconds(repeats, [&] { linearize_anew(Hessian::projected); });
  times.linearize = median_seconds(repeats, [&] { linearize_anew(Hessian::exact); });
  times.product = median_seconds(repeats, [&] { potential.apply(x, y); });
  const FloatNodeVector single_x = x.cast<float>();
  FloatNodeVector single_y;
  potential.apply(single_x, single_y);  // makes its copies
  times.single_product = median_seconds(repeats, [&] { potential.apply(single_x, single_y); });
  std::unique_ptr<const Multigrid> multigrid;
  times.set_up = median_seconds(repeats, [&] {
    multigrid = std::make_unique<const Multigrid>(problem.hierarchy(), potential, problem.constraints());
  });
  times.cycle = median_seconds(repeats, [&] { multigrid->apply(x, y); });
  return times;
}

}  // namespace hexsolver
