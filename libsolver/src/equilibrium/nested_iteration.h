// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "equilibrium/nested_errors.h"

namespace hexsolver {

template <EquilibriumLevel Level>
Solved<Level> NestedIteration<Level>::run() {
  std::unique_ptr<Level> finest;
  if (!scene_.is_open_ended()) {
    const Stopwatch setup;
    finest = make(finest_);
    level_warnings_ = finest->check(scene_);
    report_.setup_seconds = setup.seconds();
  }
  const Stopwatch solve;
  if (scene_.finds_strain && !turns_) find_strain();
  Solved<Level> best;
  for (int level = first_; level >= finest_; --level) {
    if (best.level && !has_time_for(level)) break;
    const Stopwatch watch;
    Solved<Level> next;
    std::vector<std::string> warnings;
    try {
      next.level = level == finest_ && finest ? std::move(finest) : make(level);
      if (scene_.is_open_ended()) warnings = next.level->check(scene_);
    } catch (const hexmesh::Error& e) {
      if (e.kind() != hexmesh::ErrorKind::geometry || (level == finest_ && !best.level)) throw;
      if (scene_.is_open_ended() && best.level) {
        report_.warnings.push_back(fmt::format("level {} was not solved: {}", level, e.what()));
        break;
      }
      best = {};  // a coarser level that cannot be set up is no start for the next
      continue;
    }
    solve_level(next, best);
    if (is_to_turn(next)) return run_with_rotations();
    if (!replaces(next, best)) break;
    if (scene_.asks_accuracy() && best.level) {
      // What the level before is off is known now: if that is little enough it is the one.
      compare(next);
      estimator_.write(report_.levels);
      if (is_accurate()) {
        add_look(watch.seconds());
        break;
      }
    }
    if (scene_.is_open_ended()) level_warnings_ = std::move(warnings);
    add_report(next, watch.seconds());
    best = std::move(next);
    if (carries_less(best)) break;
    if (levels_.refine && best.converged() && (best.level->num_cells() >= least_compared || level == finest_)) {
      try {
        if (!refine_by_error(best)) return run_with_rotations();
      } catch (const hexmesh::Error& e) {
        const bool is_of_those_cells =
            e.kind() == hexmesh::ErrorKind::geometry || e.kind() == hexmesh::ErrorKind::input;
        if (!is_of_those_cells) throw;
        report_.warnings.push_back(fmt::format("smaller cells were not solved: {}", e.what()));
      }
      break;
    }
  }
  if (scene_.asks_accuracy() && is_to_turn(best, true)) return run_with_rotations();
  const std::optional<std::string> refused = why_refused(best, scene_, report_.warnings);
  if (!refused) look_beyond(best);
  report_.solve_seconds = solve.seconds();
  report_.warnings.insert(report_.warnings.end(), level_warnings_.begin(), level_warnings_.end());
  conclude(best, refused);
  return best;
}

/// All again, where a level shows that what began without rotations needs them.
template <EquilibriumLevel Level>
Solved<Level> NestedIteration<Level>::run_with_rotations() {
  turns_ = true;
  report_.levels.clear();
  level_warnings_.clear();
  estimator_ = ErrorEstimator(!scene_.is_graded());
  is_sure_ = true;
  carried_.reset();
  return run();
}

template <EquilibriumLevel Level>
bool NestedIteration<Level>::has_time_for(int next) const {
  return !scene_.budget ||
         levels_.agree(clock_.seconds() + expected_seconds(report_.levels, num_cells(next)) <= *scene_.budget);
}

/// With an accuracy or a budget a level that did not converge is no better than the one before.
template <EquilibriumLevel Level>
bool NestedIteration<Level>::replaces(const Solved<Level>& next, const Solved<Level>& best) {
  if (!scene_.is_open_ended() || !best.converged() || next.converged()) return true;
  const NewtonReport& newton = next.state.newton;
  report_.warnings.push_back(fmt::format("level {} is not used: {}", next.level->level(),
                                         newton.interrupted ? "it was begun and the budget ended it" : newton.reason));
  return false;
}

/// Whether finer levels are not worth a try: two in a row fail, the finer one at no more load. Spaces are nested, so a
/// finer level gives way to less.
template <EquilibriumLevel Level>
bool NestedIteration<Level>::carries_less(Solved<Level>& last) {
  constexpr std::size_t least_cells = 50;  // fewer say little
  if (last.converged() || last.state.newton.interrupted || last.level->num_cells() < least_cells) {
    carried_.reset();
    return false;
  }
  const double reached = last.state.load_fraction;
  const std::optional<double> before = std::exchange(carried_, reached);
  if (!before || reached > *before || last.level->level() == finest_) return false;
  last.state.newton.reason += fmt::format(
      "; the level before stopped at {:.3g}: finer cells carry no more, no finer level was tried (level {} was asked)",
      *before, finest_);
  return true;
}

template <EquilibriumLevel Level>
LoadedState<typename Level::Vector> NestedIteration<Level>::solve(Level& level, const NewtonOptions& options,
                                                                  std::optional<Vector> start, Aim aim) const {
  return solve_in_load_steps(level, options, std::move(start), progress_of(level.level()), aim);
}

template <EquilibriumLevel Level>
LoadProgress NestedIteration<Level>::progress_of(int level) const {
  return [this, level](double load, int iteration, double residual, int linear) {
    if (progress_) progress_(level, load, iteration, residual, linear);
  };
}

template <EquilibriumLevel Level>
void NestedIteration<Level>::solve_level(Solved<Level>& next, const Solved<Level>& coarser, Aim aim) {
  CoarseStart<Level> from{coarser.level.get(), &coarser.state.u, {}};
  if (chooses_cells()) from.rotating_above = angle_without_effect_;
  Vector here = next.level->make_zero();
  const RotatingCells rotating = next.level->build(report_.elasticity, coarser.converged() ? &from : nullptr, here);
  if (rotating)
    explain_rotation(
        fmt::format("; on level {} {} of {} cells rotate", next.level->level(), *rotating, next.level->num_cells()),
        {});

  NewtonOptions options;
  const bool is_only_a_start = next.level->level() != finest_ && !scene_.budget;
  options.tolerance =
      is_only_a_start || scene_.asks_accuracy() ? std::max(scene_.tolerance, nested_tolerance) : scene_.tolerance;
  if (scene_.reaction_accuracy)
    options.tolerance = std::max(scene_.tolerance, std::min(nested_tolerance, 1e-3 * *scene_.reaction_accuracy));
  if (scene_.budget && coarser.level)
    options.interrupt = [this] { return levels_.agree(clock_.seconds() > *scene_.budget); };
  std::optional<Vector> start;
  if (coarser.converged() && estimates_errors()) {
    carry_on(coarser, next);
    next.coarser.push_back(copy_of(here));
  }
  if (coarser.converged())
    start = std::move(here);
  else if (levels_.start && !coarser.level)
    start = copy_of(*levels_.start);
  if (scene_.finds_tolerance && !scene_.asks_accuracy() && start) options.part_of_way = deserved_part / levels_.unseen;
  if (aim == Aim::look && scene_.asks_accuracy()) options.part_of_way = part_of_looks / levels_.unseen;
  if (aim == Aim::look)  // as many as the solution took, or what easy ones take
    options.most_linear_iterations_in_all = std::max(500, coarser.state.newton.linear_iterations);
  if (aim == Aim::result && is_only_a_start && !scene_.asks_accuracy()) aim = Aim::lead;
  next.state = solve(*next.level, options, std::move(start), aim);
  if (scene_.accuracy) sharpen(next, options);
}

/// Until the algebraic error is a small part of the accuracy asked.
template <EquilibriumLevel Level>
void NestedIteration<Level>::sharpen(Solved<Level>& next, NewtonOptions options) {
  constexpr double algebraic_part = 0.1;
  while (next.state.newton.converged && options.tolerance > scene_.tolerance) {
    const std::optional<double> error = algebraic_error(next);
    if (error && *error <= algebraic_part * *scene_.accuracy) break;
    options.tolerance = std::max(scene_.tolerance, 0.1 * options.tolerance);
    LoadedState<Vector> sharper = solve(*next.level, options, copy_of(next.state.u), Aim::result);
    if (!sharper.newton.converged) break;
    add_work(sharper.newton, next.state.newton);
    next.state = std::move(sharper);
  }
}

template <EquilibriumLevel Level>
void NestedIteration<Level>::find_strain() {
  const StrainLevels levels = levels_to_compare_strains(levels_.num_cells, first_, finest_);
  std::string unfit = "no level can be compared";
  bool is_compared = false, is_sure = false;
  for (int level = levels.coarsest; level >= levels.finest && !is_sure; --level) try {
      const StrainChoice choice =
          choose_strain([&] { return make(level); }, limits_of_strains(level), progress_of(level));
      take(choice, level);
      is_sure = choice.is_sure;
      is_compared = true;
    } catch (const hexmesh::Error& e) {
      if (e.kind() != hexmesh::ErrorKind::geometry) throw;  // else of a coarse level, which need not be fit
      unfit = e.what();
    }
  if (!is_compared) explain_rotation(fmt::format("solve.strain = \"auto\": not compared: {}", unfit), true);
}

/// Take the strain that a level asks for.
template <EquilibriumLevel Level>
void NestedIteration<Level>::take(const StrainChoice& choice, int level) {
  report_.elasticity = choice.elasticity;
  angle_without_effect_ = choice.angle_without_effect;
  compared_.reset();
  if (choice.elasticity == Elasticity::cauchy) compared_ = {level, choice.deformation};
  explain_rotation(choice.why, choice.elasticity == Elasticity::corotational);
}

/// Whether a solution without rotations needs them. Where it deforms by much more than the level on which they made no
/// difference, whose cells were too stiff to tell, they are compared again on its own. So they are on the last one of
/// an accuracy, since parts of the body may turn that no coarser one sees turn, beside what errors of its cells leave.
template <EquilibriumLevel Level>
bool NestedIteration<Level>::is_to_turn(const Solved<Level>& now, bool is_last) {
  constexpr double much_more = 1.5;
  const int level = now.level->level();
  if (!compared_ || compared_->level == level || !now.converged()) return false;
  if (!is_last && now.level->mean_deformation(now.state.u) <= much_more * compared_->deformation) return false;
  StrainLimits limits = limits_of_strains(level);
  if (is_last && scene_.accuracy) {
    constexpr double most = 0.5;
    const double of_cells = report_.levels.back().error.mean_mm.value_or(0);
    limits = {std::clamp(*scene_.accuracy - of_cells, 0.0, most * *scene_.accuracy), 1};
  }
  const std::unique_ptr<Level> again = levels_.again ? levels_.again(*now.level) : make(level);
  take(compare_strains(*now.level, now.state.u, *again, limits, progress_of(level)), level);
  return report_.elasticity == Elasticity::corotational;
}

/// @param active  of a first reason; nothing: added to it
template <EquilibriumLevel Level>
void NestedIteration<Level>::explain_rotation(const std::string& why, std::optional<bool> active) {
  for (Effect& e : report_.effects) {
    if (e.kind != EffectKind::rotation) continue;
    if (active) e.active = *active;
    e.why = active ? why : e.why.substr(0, e.why.find("; on level")) + why;
  }
}

template <EquilibriumLevel Level>
void NestedIteration<Level>::conclude(const Solved<Level>& best, const std::optional<std::string>& refused) {
  const NewtonReport& newton = best.state.newton;
  report_.converged = newton.converged;
  report_.reason = newton.reason;
  report_.load_fraction = best.state.load_fraction;
  report_.relative_residual = newton.relative_residual;
  if (refused) {
    report_.converged = false;
    report_.reason = *refused;
  }
  if (report_.converged && scene_.asks_accuracy()) {
    report_.accuracy_missed = !is_accurate();
    report_.reason = accuracy_reached(report_.levels.back(), scene_);
    if (report_.accuracy_missed && !tells_enough_)
      report_.reason += fmt::format("; it is told from {} cells, expected {}", told_from_, least_told_from);
  }
  if (scene_.budget && report_.levels.size() == 1 && levels_.agree(clock_.seconds() > *scene_.budget))
    report_.warnings.push_back(fmt::format("budget_s = {:g} is less than the first level takes", *scene_.budget));
}

}  // namespace hexsolver
