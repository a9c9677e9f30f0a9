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

/// What rounds learn from how far they move the body.
class Rounds {
public:
  /// @param still  what may be before them when they rest, beside how far the body has come
  Rounds(double still, LetsGo lets_go)
      : still_(still), lets_go_(lets_go), mode_{least_caution, lets_go == LetsGo::at_once} {}

  const PullMode& mode() const { return mode_; }   ///< of the next attachment
  double tolerance() const { return tolerance_; }  ///< of the next round
  bool at_rest() const { return at_rest_; }
  double moving() const { return at_rest_ ? 0 : before_; }  ///< by the last one, beside how far the body has come

  /// @param moved  by the last round, beside how far the body has come from where it began
  /// @param back   against the round before
  void add(double moved, bool back) {
    constexpr double part = 0.1, falls = 0.7;
    const double nothing = std::min(1e-6, still_), sharp = std::min(1e-3, still_);
    // Rounds that each move q times as much as the one before have moved q / (1 - q) before them.
    const bool rests = moved * moved <= still_ * std::max(0.0, before_ - moved);
    if (tolerance_ <= sharp && (rests || moved <= nothing))
      at_rest_ = std::exchange(mode_.lets_go, true) || lets_go_ == LetsGo::never;
    if (moved > falls * before_)  // to and fro between two states, or slowly along
      mode_.caution = back ? std::min(1.0, 2 * mode_.caution) : std::max(least_caution, mode_.caution / 2);
    before_ = moved;
    tolerance_ = std::clamp(part * moved, sharp, tolerance_);
  }

private:
  static constexpr double rough = 3e-2, least_caution = 1.0 / 64;
  double still_, tolerance_ = rough, before_ = std::numeric_limits<double>::infinity();
  LetsGo lets_go_;
  PullMode mode_;
  bool at_rest_ = false;
};

/// Newton's method, and where the scene has matches again and again, each time from what the state before is nearest
/// to, until that moves it no more: roughly at first, the last time to the tolerance.
/// @param is_look  the state is wanted for a difference only
template <class Level, class Vector = typename Level::Vector>
NewtonOutcomeOf<Vector> minimize_in_rounds(Level& level, const NewtonOptions& options, Vector& u,
                                           const NewtonProgress& progress, bool is_look, LetsGo lets_go) {
  constexpr int most_halvings = 6;
  constexpr double nothing = 1e-7;  // beside the size of the body
  const int most_rounds = is_look ? 10 : level.still() < 1e-3 ? 100 : 40;
  if (!level.attach(u, {0, lets_go == LetsGo::at_once})) return level.minimize(options, u, progress);
  const Vector begin = level.make_start();
  Vector last = copy_of(u), displacement = copy_of(u), move = level.make_zero(), move_before = level.make_zero();
  NewtonReport before;
  Rounds rounds(is_look ? 1e-2 : level.still(), lets_go);
  int halvings = 0;
  for (int round = 0; round < most_rounds && !rounds.at_rest(); ++round) {
    NewtonOptions roughly = options;
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
  NewtonOutcomeOf<Vector> outcome = level.minimize(options, u, progress);
  add_work(outcome, before);
  outcome.moving = rounds.moving();
  return outcome;
}

}  // namespace hexsolver
