// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "equilibrium/choose_strain.h"
#include "equilibrium/equilibrium_level.h"
#include "hexmesh/core/error.h"
#include "hexsolver/equilibrium/equilibrium.h"
#include "level/checks.h"
#include "level/coarser_levels.h"
#include "level/make_result.h"

namespace hexsolver {

/// From the coarsest level to the mechanical one, each from the one before. With an accuracy or a budget it ends at the
/// first level that is good enough, or the last that there was time for.
template <EquilibriumLevel Level>
class NestedIteration {
public:
  using Vector = typename Level::Vector;
  /// What levels are made of.
  struct Levels {
    std::vector<std::size_t> num_cells;  ///< of each level of the lattice
    std::vector<double> mixture;         ///< likewise, see hexmesh::count_mixture()
    double unseen = 1;                   ///< see unseen_by_cycle()
    /// A level under a scene. @throws Error{geometry} for selections and missing supports
    std::function<std::unique_ptr<Level>(int, const Scene&)> make;
    int finest_there_is = 0;                                           ///< of the levels that make() can make
    bool looks_beyond_graded = false;                                  ///< at graded cells beyond those of level 0
    std::function<bool(bool)> agree = [](bool mine) { return mine; };  ///< of what all processes decide alike
    const Vector* start = nullptr;                                     ///< of the finest: no coarser one is solved
  };

  /// @param report  with the effects of the scene
  NestedIteration(Levels levels, const Scene& scene, int finest, SolveReport& report, const SolveProgress& progress)
      : levels_(std::move(levels)),
        scene_(scene),
        coarse_scene_(for_coarser_levels(scene)),
        first_(levels_.start || has_friction(scene) ? finest : first_nested_level(levels_.num_cells, finest)),
        finest_(finest),
        report_(report),
        progress_(progress) {}

  /// @returns the last level that counts
  Solved<Level> run();

private:
  bool estimates_errors() const { return scene_.asks_accuracy() || scene_.error_estimation != ErrorEstimation::off; }
  bool chooses_cells() const {
    return scene_.finds_strain && report_.elasticity == Elasticity::corotational && scene_.rotation == Rotation::polar;
  }
  std::unique_ptr<Level> make(int level) const {
    return levels_.make(level, level == finest_ ? scene_ : coarse_scene_);
  }
  std::size_t num_cells(int level) const { return levels_.num_cells[static_cast<std::size_t>(level)]; }
  bool has_time_for(int next) const;
  bool replaces(const Solved<Level>& next, const Solved<Level>& best);
  bool carries_less(Solved<Level>& last);
  /// @param aim  look: for the error of the level before
  void solve_level(Solved<Level>& next, const Solved<Level>& coarser, Aim aim = Aim::result);
  void sharpen(Solved<Level>& next, NewtonOptions options);
  void carry_on(const Solved<Level>& coarser, Solved<Level>& next);
  void compare(Solved<Level>& next);
  bool looks_beyond(const Solved<Level>& best) const;
  void look_beyond(const Solved<Level>& best);
  void add_look(double seconds);
  void find_strain();
  LoadedState<Vector> solve(Level& level, const NewtonOptions& options, std::optional<Vector> start, Aim aim) const;
  std::optional<double> algebraic_error(const Solved<Level>& solved) const;
  void add_report(Solved<Level>& now, double seconds);
  void explain_rotation(const std::string& why, std::optional<bool> active);
  bool is_accurate() const;
  void conclude(const Solved<Level>& best, const std::optional<std::string>& refused);

  Levels levels_;
  const Scene& scene_;
  Scene coarse_scene_;
  int first_, finest_;
  SolveReport& report_;
  const SolveProgress& progress_;
  Stopwatch clock_;
  std::vector<std::string> level_warnings_;  ///< of the last level that counts
  ErrorEstimator estimator_;
  std::optional<double> carried_;    ///< part of the load that the last level reached, if it failed
  double angle_without_effect_ = 0;  ///< of cells that need not rotate, with strain = "auto" [rad]
};

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
  if (scene_.finds_strain) find_strain();
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
  }
  const std::optional<std::string> refused = why_refused(best, scene_, report_.warnings);
  if (!refused && looks_beyond(best)) look_beyond(best);
  report_.solve_seconds = solve.seconds();
  report_.warnings.insert(report_.warnings.end(), level_warnings_.begin(), level_warnings_.end());
  conclude(best, refused);
  return best;
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
  return solve_in_load_steps(
      level, options, std::move(start),
      [&](double load, int iteration, double residual, int linear) {
        if (progress_) progress_(level.level(), load, iteration, residual, linear);
      },
      aim);
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
  std::optional<StrainChoice> choice;
  std::string unfit;
  for (int level = levels.coarsest; level >= levels.finest && !(choice && choice->is_sure); --level) try {
      choice = choose_strain<Level>(
          level, level - finest_, scene_, [this](int number) { return make(number); },
          [&](double load, int iteration, double residual, int linear) {
            if (progress_) progress_(level, load, iteration, residual, linear);
          });
    } catch (const hexmesh::Error& e) {
      if (e.kind() != hexmesh::ErrorKind::geometry) throw;  // else of a coarse level, which need not be fit
      unfit = e.what();
    }
  if (!choice) return explain_rotation(fmt::format("solve.strain = \"auto\": not compared: {}", unfit), true);
  report_.elasticity = choice->elasticity;
  angle_without_effect_ = choice->angle_without_effect;
  explain_rotation(choice->why, choice->elasticity == Elasticity::corotational);
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
      Vector change = next.level->make_zero();
      set_sum(change, next.state.u, -1, *u);
      differences.back() = next.level->size_in_material(change, false);
    }
  for (Effect& e : report_.effects)
    if (e.kind == EffectKind::error_estimate && !differences.empty()) e.active = true;
  LevelMeasures measures = next.level->measures(next.state.u);
  measures.mixture = levels_.mixture[static_cast<std::size_t>(next.level->level())];
  estimator_.add(std::move(differences), std::move(measures), next.level->level_of_largest());
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

/// Whether the error of the last level is to be told from the next finer one.
template <EquilibriumLevel Level>
bool NestedIteration<Level>::looks_beyond(const Solved<Level>& best) const {
  if (scene_.is_graded() && finest_ == 0)
    return best.converged() && best.level->level() == 0 && levels_.looks_beyond_graded;
  const int needed = finest_level_needed(scene_, levels_.num_cells, finest_);
  return best.converged() && needed < finest_ && needed >= levels_.finest_there_is;
}

/// Solve the next finer level, or of graded cells of level 0 them with all but the finest halved, and compare. The
/// largest cells are halved too. It starts from the solution and ends where that does not lead there soon: load steps
/// of a body that buckles took six times as long as its solution.
template <EquilibriumLevel Level>
void NestedIteration<Level>::look_beyond(const Solved<Level>& best) {
  const Stopwatch watch;
  Solved<Level> finer;
  Scene scene = scene_;
  scene.coarser_by = best.level->level_of_largest() - finest_ - (finest_ == 0);
  try {
    finer.level = levels_.make(std::max(0, finest_ - 1), scene);
    solve_level(finer, best, Aim::look);
  } catch (const hexmesh::Error& e) {
    if (e.kind() != hexmesh::ErrorKind::geometry) throw;  // else of that level alone
    return;
  }
  if (!finer.converged()) return;
  compare(finer);
  estimator_.write(report_.levels);
  add_look(watch.seconds());
}

template <EquilibriumLevel Level>
void NestedIteration<Level>::add_look(double seconds) {
  for (Effect& e : report_.effects)
    if (e.kind == EffectKind::error_estimate) e.seconds += seconds;
}

/// A level that is not the finest there is must have cells enough for its differences to mean something, and keep
/// what is asked with what an estimate may miss.
template <EquilibriumLevel Level>
bool NestedIteration<Level>::is_accurate() const {
  constexpr std::size_t least_cells = 100;
  const double margin = scene_.is_graded() || !scene_.contacts.empty() ? 3 : 1.5;
  const LevelReport& last = report_.levels.back();
  const bool is_finest = last.level == finest_ && !scene_.is_graded();
  if (!is_finest && last.cells < least_cells) return false;
  const auto holds = [&](const std::optional<double>& error, const std::optional<double>& asked) {
    return !asked || (error && (is_finest ? 1 : margin) * *error <= *asked);
  };
  return scene_.asks_accuracy() && last.newton.converged && holds(last.error.mean_mm, scene_.accuracy) &&
         holds(last.error.of_reactions, scene_.reaction_accuracy);
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
  }
  if (scene_.budget && report_.levels.size() == 1 && levels_.agree(clock_.seconds() > *scene_.budget))
    report_.warnings.push_back(fmt::format("budget_s = {:g} is less than the first level takes", *scene_.budget));
}

}  // namespace hexsolver
