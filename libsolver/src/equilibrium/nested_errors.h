// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "equilibrium/nested_levels.h"

/// What a nested iteration says of errors, and does for an accuracy.
namespace hexsolver {

template <EquilibriumLevel Level>
std::optional<double> NestedIteration<Level>::algebraic_error(const Solved<Level>& solved) const {
  if (!solved.state.algebraic_error) return {};
  return levels_.unseen * solved.level->size_in_material(*solved.state.algebraic_error, true).mean;
}

/// The solutions that were compared with the coarser level, here; those of more than two levels before are left behind.
template <EquilibriumLevel Level>
void NestedIteration<Level>::carry_on(const Solved<Level>& coarser, Solved<Level>& next) {
  constexpr std::size_t most = 2;
  for (std::size_t n = 0; n < coarser.coarser.size(); ++n) {
    next.coarser.emplace_back();
    if (n + most <= coarser.coarser.size() || !coarser.coarser[n]) continue;
    next.coarser.back() = next.level->make_zero();
    next.level->prolongate(*coarser.level, *coarser.coarser[n], *next.coarser.back());
  }
}

/// Tell the estimator of a level what it differs from those before.
template <EquilibriumLevel Level>
void NestedIteration<Level>::compare(Solved<Level>& next) {
  if (!estimates_errors()) return;
  std::vector<std::optional<ElasticCells::Size>> differences;
  if (next.converged())
    for (std::optional<Vector>& u : next.coarser) {
      differences.emplace_back();
      if (!u) continue;
      differences.back() = next.level->size_in_material(next.change_from(*u), false);
    }
  for (Effect& e : report_.effects)
    if (e.kind == EffectKind::error_estimate && !differences.empty()) e.active = true;
  LevelMeasures measures = next.level->measures(next.state.u);
  measures.averages = levels_.averages[static_cast<std::size_t>(next.level->level_of_largest())];
  estimator_.add(std::move(differences), std::move(measures), next.level->level_of_largest());
  told_from_ = next.level->num_cells();
  tells_enough_ = told_from_ >= least_told_from || next.level->level_of_largest() == 0;
}

template <EquilibriumLevel Level>
void NestedIteration<Level>::add_report(Solved<Level>& now, double seconds) {
  const Level& level = *now.level;
  report_.levels.push_back({level.level(), level.num_cells(), level.num_nodes(), seconds, now.state.newton, {}});
  const std::optional<double> algebraic = algebraic_error(now);
  now.state.algebraic_error.reset();
  if (!scene_.asks_accuracy() || report_.levels.size() == 1) compare(now);
  estimator_.write(report_.levels);
  report_.levels.back().error.algebraic_mm = algebraic;
  level.add_effect_seconds(report_);
}

/// Of the error of the last level, tell what finer ones show, or graded cells all halved.
template <EquilibriumLevel Level>
void NestedIteration<Level>::look_beyond(const Solved<Level>& best) {
  if (!best.converged()) return;
  std::optional<Solved<Level>> last;
  const auto look = [&](const auto& make) {
    const Solved<Level>& from = last ? *last : best;
    last = look_at([&] { return make(*from.level); }, from);
    return last.has_value();
  };
  if (scene_.is_graded()) {
    if (!levels_.looks_beyond_graded) return;
    while (look([this](const Level& of) { return levels_.halve(of); }) && !tells_enough_) continue;
    return;
  }
  const int finest = std::max(finest_level_needed(scene_, levels_.num_cells, finest_), levels_.finest_there_is);
  for (int level = finest_ - 1; level >= finest; --level)
    if (!look([this, level](const Level& /*of*/) { return levels_.make(level, scene_); })) return;
}

/// Solve other cells and compare. They start from a solution and end where that does not lead there soon: load steps of
/// a body that buckles took six times as long as its solution.
/// @returns nothing where it does not
template <EquilibriumLevel Level>
template <class Make>
std::optional<Solved<Level>> NestedIteration<Level>::look_at(const Make& make, const Solved<Level>& from) {
  const Stopwatch watch;
  Solved<Level> finer;
  try {
    finer.level = make();
    solve_level(finer, from, Aim::look);
  } catch (const hexmesh::Error& e) {
    if (e.kind() != hexmesh::ErrorKind::geometry) throw;  // else of that level alone
    return {};
  }
  if (!finer.converged()) return {};
  compare(finer);
  estimator_.write(report_.levels);
  add_look(watch.seconds());
  return finer;
}

/// Graded cells, again and again: halve those that most of the error comes from, until what all of them halved differ
/// by says that it is little enough. Where that tells nothing all are halved. Cells may agree with their halves by
/// chance: an estimate is sure where the one before it was not far too small, as is seen by then.
/// @returns false: all is to be solved again, see is_to_turn()
template <EquilibriumLevel Level>
bool NestedIteration<Level>::refine_by_error(Solved<Level>& best) {
  constexpr double far_too_small = 0.5, elsewhere = 10;
  for (int looks = 0;; ++looks) {
    const Stopwatch look;
    Solved<Level> halved;
    halved.level = levels_.halve(*best.level);
    if (!halved.level) return true;
    solve_level(halved, best, Aim::look);
    if (halved.converged()) {
      const std::size_t before = report_.levels.size() - (looks > 0 ? 2 : 1);
      const std::optional<double> told = report_.levels[before].error.mean_mm;
      compare(halved);
      estimator_.write(report_.levels);
      estimator_.forget_last();
      const std::optional<double> shown = report_.levels[before].error.mean_mm;
      is_sure_ = looks > 0 && told && shown && *told >= far_too_small * *shown;
    }
    add_look(look.seconds());
    if (is_accurate()) return true;
    const Stopwatch watch;
    Solved<Level> next;
    if (report_.levels.back().error.mean_mm) {
      const Vector change = halved.change_from(*halved.coarser.back());
      next.level = levels_.refine(*best.level, *halved.level, halved.state.u, change, part_allowed());
    } else {
      next.level = levels_.halve(*best.level);
    }
    halved = {};
    std::vector<std::string> warnings = next.level->check(scene_);
    solve_level(next, best);
    if (is_to_turn(next)) return false;
    if (!replaces(next, best)) return true;
    // Where the start leads nowhere, load steps may come to another equilibrium.
    const std::optional<double> told = report_.levels.back().error.mean_mm;
    const double moved = next.level->size_in_material(next.change_from(*next.coarser.back()), false).mean;
    if (told && moved > elsewhere * *told) {
      levels_.give_way();
      return true;
    }
    level_warnings_ = std::move(warnings);
    compare(next);
    add_report(next, watch.seconds());
    best = std::move(next);
  }
}

template <EquilibriumLevel Level>
void NestedIteration<Level>::add_look(double seconds) {
  for (Effect& e : report_.effects)
    if (e.kind == EffectKind::error_estimate) e.seconds += seconds;
}

/// By how much an estimate may be too small.
template <EquilibriumLevel Level>
double NestedIteration<Level>::margin() const {
  if (estimator_.knows_finest()) return 1;
  return is_sure_ && estimator_.closes_in() ? usual_margin(scene_, report_.elasticity) : unsure_margin;
}

/// Of the error of the last level, what may be left.
template <EquilibriumLevel Level>
double NestedIteration<Level>::part_allowed() const {
  const ErrorEstimate& error = report_.levels.back().error;
  const double usual = usual_margin(scene_, report_.elasticity);
  double part = 1;
  const auto allow = [&](const std::optional<double>& told, const std::optional<double>& asked) {
    if (told && asked) part = std::min(part, *asked / (usual * *told));
  };
  allow(error.mean_mm, scene_.accuracy);
  allow(error.of_reactions, scene_.reaction_accuracy);
  return part;
}

/// A level that is not the finest there is must have cells enough for its differences to mean something, and keep
/// what is asked with what an estimate may miss.
template <EquilibriumLevel Level>
bool NestedIteration<Level>::is_accurate() const {
  const LevelReport& last = report_.levels.back();
  const bool is_finest = last.level == finest_ && !scene_.is_graded();
  if (!is_finest && (last.cells < levels_.least_cells || !tells_enough_)) return false;
  const auto holds = [&](const std::optional<double>& error, const std::optional<double>& asked) {
    return !asked || (error && (is_finest ? 1 : margin()) * *error <= *asked);
  };
  return scene_.asks_accuracy() && last.newton.converged && holds(last.error.mean_mm, scene_.accuracy) &&
         holds(last.error.of_reactions, scene_.reaction_accuracy);
}

}  // namespace hexsolver
