// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/plan/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "core/stopwatch.h"
#include "equilibrium/error_estimator.h"
#include "hexmesh/core/error.h"
#include "hexmesh/lattice/condensed_cells.h"
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
#include "plan/trial.h"

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

/// Of condensed cells of the level that is solved last, and while they are found, from the voxels on.
struct CondensedBytes {
  std::size_t kept = 0, on_the_way = 0;
};

CondensedBytes condensed_bytes(const hexmesh::Lattice& lattice, const Scene& scene, int level) {
  constexpr std::size_t on_the_way_per_voxel = 110;
  CondensedBytes out;
  if (scene.stiffness_of_cells() != Stiffness::condensed) return out;
  out.on_the_way = on_the_way_per_voxel * lattice.level(0).cells.size();
  hexmesh::Condensation condensation(lattice, {}, hexmesh::CondensedDilatation::mean);
  const int coarsest = std::min(level + (scene.is_graded() ? scene.coarser_by : 0), lattice.num_levels() - 1);
  for (int n = 1; n <= coarsest; ++n)
    out.kept += sizeof(hexmesh::CondensedElement) * condensation.level(n).condensed.size();
  constexpr std::size_t of_products = 2 * sizeof(CellMatrix);  // of that level, and of its multigrid's first
  if (level > 0) out.kept += (sizeof(ElementModel) + of_products) * condensation.level(level).condensed.size();
  return out;
}

double usual_bytes(Elasticity elasticity) {
  if (is_hyperelastic(elasticity)) return hyperelastic_bytes;
  return elasticity == Elasticity::cauchy ? linear_bytes : corotational_bytes;
}

bool has_frames(const Scene& scene) {
  return scene.elasticity == Elasticity::corotational && scene.rotation == Rotation::polar;
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

/// How many times too large the estimated error of a level is for the accuracies asked; nothing: unknown.
std::optional<double> times_too_large(const LevelReport& level, const Scene& scene, double margin) {
  double out = 0;
  for (const auto& [error, asked] :
       {std::pair(level.error.mean_mm, scene.accuracy), std::pair(level.error.of_reactions, scene.reaction_accuracy)}) {
    if (!asked) continue;
    if (!error) return {};
    out = std::max(out, margin * *error / *asked);
  }
  return out;
}

/// Where an accuracy is expected to be kept that was not while levels were tried.
std::pair<int, std::string> expect_accuracy(const Scene& scene, const std::vector<std::size_t>& num_cells,
                                            const SolveReport& tried, int finest) {
  std::vector<double> times;
  int level = finest;
  for (const LevelReport& l : tried.levels)
    if (const std::optional<double> t = times_too_large(l, scene, usual_margin(scene, tried.elasticity))) {
      times.push_back(*t);
      level = l.level;
    }
  if (times.empty()) return {finest, "of the levels tried no error is known"};
  const double rate = rate_of_errors(times);
  const std::string why = fmt::format("level {} is {:.2g} times too far off, and {:.2g} of that is left a level", level,
                                      times.back(), rate);
  const auto counts = [&](int n) {
    const auto cells = [&](int of) { return num_cells[static_cast<std::size_t>(of)]; };
    const bool is_told = n <= finest + 1 || cells(n - 1) >= least_told_from;
    return n <= tried.levels.back().level && cells(n) >= least_compared && is_told;
  };
  for (double left = times.back(); level > finest && !(left <= 1 && counts(level)); --level) left *= rate;
  return {level, why};
}

/// Of an accuracy or a budget: the levels to where it is expected to end, and one more that an accuracy looks at.
void plan_to_the_end(const hexmesh::Lattice& lattice, const Scene& scene, const std::vector<std::size_t>& num_cells,
                     int first, int finest, const Trial& trial, SolvePlan& plan) {
  const SolveReport& tried = trial.report();
  SolvePlan::End end{finest, {}, plan.strain_seconds};
  if (trial.keeps_accuracy())
    std::tie(end.level, end.why) = std::pair(tried.levels.back().level, tried.reason);
  else if (scene.asks_accuracy())
    std::tie(end.level, end.why) = expect_accuracy(scene, num_cells, tried, finest);
  const int last = trial.keeps_accuracy() ? std::max(end.level - 1, finest) : finest;
  std::vector<LevelReport> before;
  for (int level = first; level >= last; --level) {
    const std::size_t cells = num_cells[static_cast<std::size_t>(level)];
    if (scene.budget && !before.empty() && end.most_seconds + expected_seconds(before, cells) > *scene.budget) {
      if (level >= end.level)  // as a solution decides
        std::tie(end.level, end.why) = std::pair(level + 1, fmt::format("level {} would take too long", level));
      break;
    }
    const bool is_look = level == end.level - 1 && scene.asks_accuracy();
    const double seconds = is_look && trial.keeps_accuracy() ? seconds_of(tried.effects, EffectKind::error_estimate)
                                                             : trial.to_the_end(level);
    LevelReport& report = before.emplace_back();
    report.cells = cells;
    report.seconds = seconds;
    end.most_seconds += seconds;
    if (level < end.level && !is_look) continue;
    const SolvePlan::Level planned = plan_level(lattice, scene, level, seconds);
    if (is_look)
      plan.look = planned;
    else
      plan.levels.push_back(planned);
  }
  plan.levels.back().bytes += set_up(lattice, scene, end.level).bytes;
  set_seconds(plan, EffectKind::elasticity, plan.seconds());
  if (plan.look) set_seconds(plan, EffectKind::error_estimate, plan.look->seconds);
  plan.end = end;
}

SolvePlan plan_equilibrium(const hexmesh::Lattice& lattice, const Scene& scene, int level) {
  SolvePlan plan;
  plan.effects = list_effects(scene_at_end(scene));
  const std::vector<std::size_t> num_cells = cells_of_levels(lattice, scene);
  const int first = has_friction(scene) ? level : first_nested_level(num_cells, level);
  const int look = scene.is_graded() ? level : finest_level_needed(scene, num_cells, level);
  Trial trial(lattice, scene, first, level, look);
  plan.strain_seconds = trial.beside_levels();
  if (scene.is_open_ended()) {
    plan_to_the_end(lattice, scene, num_cells, first, level, trial, plan);
    return plan;
  }
  const SetUp made = set_up(lattice, scene, level);
  plan.setup_seconds = made.seconds;
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
    plan.look = plan_level(lattice, scene, look, 0);
    for (int n = level - 1; n >= look; --n) plan.look->seconds += trial.as_a_start(n);
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
  double sum = reading_seconds + setup_seconds + strain_seconds + (look ? look->seconds : 0);
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
  constexpr std::size_t program = 30 << 20;  // with what large pages take more
  const std::size_t beside = plan.look ? plan.look->bytes : plan.levels.size() > 1 ? plan.levels.end()[-2].bytes : 0;
  plan.finds_cells = finds_cells;
  const CondensedBytes condensed =
      condensed_bytes(lattice, scene, plan.look ? plan.look->level : plan.levels.back().level);
  plan.bytes = program + hexmesh::bytes_of(lattice) +
               std::max(condensed.kept + plan.levels.back().bytes + beside, condensed.on_the_way);
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
