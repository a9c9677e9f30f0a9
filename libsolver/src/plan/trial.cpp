// SPDX-License-Identifier: Apache-2.0
#include "plan/trial.h"

#include <algorithm>

#include "equilibrium/error_estimator.h"
#include "hexsolver/equilibrium/equilibrium.h"
#include "level/coarser_levels.h"
#include "level/grading.h"
#include "level/level_problem.h"

namespace hexsolver {

int finest_of(const std::vector<std::size_t>& num_cells, std::size_t most, int first, int last) {
  int level = first;
  while (level > last && num_cells[static_cast<std::size_t>(level) - 1] <= most) --level;
  return level;
}

double seconds_of(const std::vector<Effect>& effects, EffectKind kind) {
  for (const Effect& e : effects)
    if (e.kind == kind) return e.seconds;
  return 0;
}

double growth(const std::vector<std::size_t>& num_cells, int from, int to) {
  return static_cast<double>(num_cells[static_cast<std::size_t>(to)]) /
         static_cast<double>(num_cells[static_cast<std::size_t>(from)]);
}

Trial::Trial(const hexmesh::Lattice& lattice, const Scene& scene, int first, int level, int finest)
    : lattice_(lattice), scene_(scene), level_(level), num_cells_(cells_of_levels(lattice, scene)) {
  constexpr std::size_t quick_to_solve = 3000;
  constexpr double most_seconds = 1;
  scene_.error_estimation = ErrorEstimation::off;
  const auto solve_it = [&](int n) {
    tried_ = n;
    report_ = solve(scene.tolerance);
    if (n > finest && !keeps_accuracy()) find_paces();
  };
  int begin = finest_of(num_cells_, quick_to_solve, first, level);
  if (scene.asks_accuracy()) begin = std::clamp(first - 1, level, begin);  // one to compare with
  try_levels(begin, level, solve_it);
  while (tried_ > level && !keeps_accuracy() && to_the_end(tried_ - 1) < most_seconds)
    try_levels(tried_ - 1, level, solve_it);
}

void Trial::find_paces() {
  // Larger levels do not fit into the machine's caches, and have work for all threads.
  constexpr std::size_t quick_to_make = 20000;
  const Scene coarse = for_coarser_levels(scene_);
  const int large = finest_of(num_cells_, quick_to_make, tried_, level_);
  pace_ = pace_of(lattice_, coarse, tried_);
  pace_of_large_ = large == tried_ ? pace_ : pace_of(lattice_, coarse, large);
}

Trial::Pace Trial::pace_of(const hexmesh::Lattice& lattice, const Scene& scene, int level) {
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

/// To the level tried; its levels with the seconds that they take in all.
SolveReport Trial::solve(double tolerance) const {
  Scene scene = tried_ == level_ ? scene_ : for_coarser_levels(scene_);
  if (!scene.asks_accuracy()) scene.name_level(tried_);
  scene.tolerance = tolerance;
  SolveReport report = solve_equilibrium(lattice_, scene, tried_).report;
  if (!scene.loaded || !acts_after_loaded(scene)) return report;
  for (LevelReport& l : report.levels)
    for (const LevelReport& before : report.loaded->scan->levels)
      if (before.level == l.level) l.seconds += before.seconds;
  return report;
}

double Trial::beside_levels() const {
  if (!scene_.finds_strain) return 0;
  double left = report_.solve_seconds - seconds_of(report_.effects, EffectKind::error_estimate);
  for (const LevelReport& l : report_.levels) left -= l.seconds;
  return std::max(0.0, left);
}

double Trial::to_the_end(int level) const {
  for (const LevelReport& l : report_.levels)
    if (l.level == level) return l.seconds;
  return scaled(report_.levels.back().seconds, level);
}

double Trial::as_a_start(int level) {
  if (level >= tried_) return to_the_end(level);
  if (!start_) start_ = solve(std::max(scene_.tolerance, nested_tolerance)).levels.back().seconds;
  return scaled(*start_, level);
}

double Trial::scaled(double seconds, int level) const {
  const double solving = std::max(0.0, seconds - pace_.forming) * growth(num_cells_, tried_, level);
  return pace_of_large_.forming + pace_of_large_.product / pace_.product * solving;
}

}  // namespace hexsolver
