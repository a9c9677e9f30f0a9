// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "match/matching.h"
#include "newton/minimize.h"

namespace hexsolver {

/// When rounds let go of what stays far, beside the rest.
enum class LetsGo {
  at_once,
  at_rest,  ///< what is to move far is far at first; until they rest again
  never
};

/// What a solution is wanted for.
enum class Aim {
  result,
  lead,  ///< to the next load step or the next finer level
  look   ///< for its difference from another
};

/// When rounds end.
struct RoundLimits {
  double still = 1e-3;            ///< what they may still move, beside how far the body has come
  double first_tolerance = 3e-2;  ///< of the first of them
  int most = 40;
};

/// What rounds learn from how far they move the body.
class Rounds {
public:
  Rounds(const RoundLimits& limits, LetsGo lets_go)
      : still_(limits.still),
        tolerance_(limits.first_tolerance),
        lets_go_(lets_go),
        mode_{least_caution, lets_go == LetsGo::at_once} {}

  const PullMode& mode() const { return mode_; }   ///< of the next attachment
  double tolerance() const { return tolerance_; }  ///< of the next round
  bool at_rest() const { return at_rest_; }
  bool in_vain() const { return failed_ >= most_failed; }   ///< so many one after the other found no solution
  double moving() const { return at_rest_ ? 0 : before_; }  ///< by the last one, beside how far the body has come

  /// @param moved   by the last round, beside how far the body has come from where it began
  /// @param back    against the round before
  /// @param solved  whether it found a solution: else that nothing moves says nothing
  void add(double moved, bool back, bool solved) {
    failed_ = solved ? 0 : failed_ + 1;
    constexpr double part = 0.1, falls = 0.7, least_learnt = 1.0 / 4;
    const double nothing = std::min(1e-6, still_), sharp = std::min({1e-3, still_, tolerance_});
    // Rounds that each move q times as much as the one before have moved q / (1 - q) before them.
    const bool is_first = before_ == std::numeric_limits<double>::infinity();
    const bool rests = !is_first && moved * moved <= still_ * std::max(0.0, before_ - moved);
    if (solved && tolerance_ <= sharp && (rests || moved <= nothing))
      at_rest_ = std::exchange(mode_.lets_go, true) || lets_go_ == LetsGo::never;
    const bool goes_on = moved > falls * before_;  // to and fro between two states, or slowly along
    if (!solved)
      mode_.stiffer = std::max(1.0, mode_.stiffer / 2);
    else if (goes_on)
      mode_.stiffer = std::min(most_stiffer, 2 * mode_.stiffer);
    if (goes_on) {
      mode_.caution = back ? std::min(1.0, 2 * mode_.caution) : std::max(least_caution, mode_.caution / 2);
      if (back) {
        mode_.learns = std::max(least_learnt, mode_.learns / 2);
        patience_ = std::min(2 * patience_, most_patience);
      }
    }
    calm_ = back ? 0 : calm_ + 1;
    if (calm_ == patience_) {
      mode_.learns = std::min(1.0, 2 * mode_.learns);
      calm_ = 0;
    }
    before_ = moved;
    tolerance_ = std::clamp(part * moved, sharp, tolerance_);
  }

private:
  static constexpr double least_caution = 1.0 / 64;
  static constexpr double most_stiffer = 16;
  static constexpr int most_patience = 80, most_failed = 20;
  double still_, tolerance_, before_ = std::numeric_limits<double>::infinity();
  LetsGo lets_go_;
  PullMode mode_;
  int failed_ = 0;               ///< the last rounds, without a solution
  int calm_ = 0, patience_ = 5;  ///< rounds that went on, and so many after which more is learnt again
  bool at_rest_ = false;
};

/// With places held as they are, where forces have jumps without.
/// @returns nothing where they have none, or where there is no solution: then u is what it was, and the work `in_vain`
template <class Level, class Vector>
std::optional<NewtonOutcomeOf<Vector>> minimize_with_places_held(Level& level, const NewtonOptions& options, Vector& u,
                                                                 const NewtonProgress& progress,
                                                                 NewtonReport& in_vain) {
  if constexpr (requires { level.settle(u); }) {
    if (!level.settle(u)) return {};
    Vector free = copy_of(u);
    NewtonOutcomeOf<Vector> outcome = level.minimize(options, u, progress);
    if (outcome.converged) return outcome;
    add_work(in_vain, outcome);
    u = std::move(free);
    level.unsettle();
  }
  return {};
}

/// To the tolerance where rounds end: with places held as they are then, where forces have jumps without; where that
/// fails, or they are not at rest, free first.
template <class Level, class Vector>
NewtonOutcomeOf<Vector> end_rounds(Level& level, const NewtonOptions& options, Vector& u,
                                   const NewtonProgress& progress, bool at_rest) {
  NewtonReport in_vain;
  const auto with_places_held = [&] { return minimize_with_places_held(level, options, u, progress, in_vain); };
  std::optional<NewtonOutcomeOf<Vector>> end;
  if (at_rest) end = with_places_held();
  if (!end) {
    end = level.minimize(options, u, progress);
    if (end->converged)
      if (auto held = with_places_held()) {
        add_work(in_vain, *end);
        end = std::move(held);
      }
  }
  add_work(*end, in_vain);
  return std::move(*end);
}

/// Newton's method, and where the scene has matches again and again, each time from what the state before is nearest
/// to, until that moves it no more: roughly at first, the last time to the tolerance.
template <class Level, class Vector = typename Level::Vector>
NewtonOutcomeOf<Vector> minimize_in_rounds(Level& level, const NewtonOptions& options, Vector& u,
                                           const NewtonProgress& progress, Aim aim, LetsGo lets_go) {
  constexpr int most_halvings = 6;
  constexpr double nothing = 1e-7;  // beside the size of the body
  RoundLimits limits = level.round_limits(aim);
  if (aim == Aim::look) limits = {1e-2, limits.first_tolerance, 10};
  if (!level.attach(u, {0, lets_go == LetsGo::at_once})) return level.minimize(options, u, progress);
  NewtonOptions sharply = options;
  sharply.part_of_way = 0;  // a round moves by little
  const Vector begin = level.make_start();
  Vector last = copy_of(u), displacement = copy_of(u), move = level.make_zero(), move_before = level.make_zero();
  NewtonReport before;
  Rounds rounds(limits, lets_go);
  int halvings = 0;
  const auto moved_since = [&] {  // the last round, beside how far the body has come
    set_sum(move, u, -1, last);
    set_sum(displacement, u, -1, begin);
    return level.size_in_material(move, true).mean /
           (level.size_in_material(displacement, true).mean + nothing * level.diameter());
  };
  for (int round = 0; round < limits.most && !rounds.at_rest() && !rounds.in_vain(); ++round) {
    NewtonOptions roughly = sharply;
    roughly.tolerance = std::max(rounds.tolerance(), options.tolerance);
    roughly.estimate_error = false;
    NewtonOutcomeOf<Vector> outcome = level.minimize(roughly, u, progress);
    add_work(before, outcome);
    if (outcome.interrupted) break;
    if (outcome.end == NewtonEnd::no_descent)  // where forces jump no step may lead down
      if (auto held = minimize_with_places_held(level, roughly, u, progress, before)) {
        outcome = std::move(*held);
        add_work(before, outcome);
      }
    if (outcome.end == NewtonEnd::start_is_inside_out && halvings++ < most_halvings) {
      set_sum(displacement, u, -1, begin);  // a coarser level's solution: halfway back
      set_sum(u, begin, 0.5, displacement);
    }
    level.attach(u, rounds.mode());
    swap_fields(move, move_before);
    const double moved = moved_since();
    const bool back = dot(move, move_before) < 0;
    set_to(last, u);
    rounds.add(moved, back, outcome.converged);
  }
  NewtonOutcomeOf<Vector> outcome = end_rounds(level, sharply, u, progress, rounds.at_rest());
  add_work(outcome, before);
  // The last solution is one that rounds would leave where it is away from theirs.
  const double moved = moved_since(), away = std::max(1e-3, 10 * limits.still);
  outcome.moving = moved > away ? std::max(moved, rounds.moving()) : rounds.moving();
  return outcome;
}

}  // namespace hexsolver
