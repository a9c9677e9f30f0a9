// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <limits>
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
  double moving() const { return at_rest_ ? 0 : before_; }  ///< by the last one, beside how far the body has come

  /// @param moved  by the last round, beside how far the body has come from where it began
  /// @param back   against the round before
  void add(double moved, bool back) {
    constexpr double part = 0.1, falls = 0.7, least_learnt = 1.0 / 4;
    const double nothing = std::min(1e-6, still_), sharp = std::min({1e-3, still_, tolerance_});
    // Rounds that each move q times as much as the one before have moved q / (1 - q) before them.
    const bool is_first = before_ == std::numeric_limits<double>::infinity();
    const bool rests = !is_first && moved * moved <= still_ * std::max(0.0, before_ - moved);
    if (tolerance_ <= sharp && (rests || moved <= nothing))
      at_rest_ = std::exchange(mode_.lets_go, true) || lets_go_ == LetsGo::never;
    if (moved > falls * before_) {  // to and fro between two states, or slowly along
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
  static constexpr int most_patience = 80;
  double still_, tolerance_, before_ = std::numeric_limits<double>::infinity();
  LetsGo lets_go_;
  PullMode mode_;
  int calm_ = 0, patience_ = 5;  ///< rounds that went on, and so many after which more is learnt again
  bool at_rest_ = false;
};

/// From a solution but for jumps of forces, which places that are held have not, to the tolerance; where that fails it
/// stays.
template <class Level, class Vector>
void settle(Level& level, const NewtonOptions& options, Vector& u, const NewtonProgress& progress,
            NewtonOutcomeOf<Vector>& outcome) {
  Vector loose = copy_of(u);
  NewtonOutcomeOf<Vector> settled = level.minimize(options, u, progress);
  if (settled.converged) {
    add_work(settled, outcome);
    outcome = std::move(settled);
  } else {
    add_work(outcome, settled);
    u = std::move(loose);
    level.unsettle();
  }
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
  for (int round = 0; round < limits.most && !rounds.at_rest(); ++round) {
    NewtonOptions roughly = sharply;
    roughly.tolerance = std::max(rounds.tolerance(), options.tolerance);
    roughly.estimate_error = false;
    const NewtonOutcomeOf<Vector> outcome = level.minimize(roughly, u, progress);
    add_work(before, outcome);
    if (outcome.interrupted) break;
    if (outcome.end == NewtonEnd::start_is_inside_out && halvings++ < most_halvings) {
      set_sum(displacement, u, -1, begin);  // a coarser level's solution: halfway back
      set_sum(u, begin, 0.5, displacement);
    }
    level.attach(u, rounds.mode());
    swap_fields(move, move_before);
    set_sum(move, u, -1, last);
    set_sum(displacement, u, -1, begin);
    const double moved = level.size_in_material(move, true).mean;
    const double size = level.size_in_material(displacement, true).mean;
    const bool back = dot(move, move_before) < 0;
    set_to(last, u);
    rounds.add(moved / (size + nothing * level.diameter()), back);
  }
  NewtonOutcomeOf<Vector> outcome = level.minimize(sharply, u, progress);
  if constexpr (requires { level.settle(u); })
    if (outcome.converged && level.settle(u)) settle(level, sharply, u, progress, outcome);
  add_work(outcome, before);
  outcome.moving = rounds.moving();
  return outcome;
}

}  // namespace hexsolver
