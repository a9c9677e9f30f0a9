// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "equilibrium/rounds.h"
#include "hexsolver/scene/history.h"
#include "newton/minimize.h"

namespace hexsolver {

/// Told after every Newton step of a load step: load fraction, iteration, relative residual, linear iterations.
using LoadProgress = std::function<void(double, int, double, int)>;

/// The load of a level: all at once where Newton manages that, else cut back and raised in steps.
class LoadSteps {
public:
  /// @param largest    part of the load that a step may be
  /// @param has_start  whether the first step is the whole load, from a coarser level's solution
  /// @param aim        look: no other step is taken if the first one fails; lead: fewer are
  LoadSteps(double largest, bool has_start, Aim aim = Aim::result)
      : largest_(largest), step_(has_start ? 1 : largest), from_start_(has_start), aim_(aim) {}

  double target() const { return std::min(1.0, reached_ + step_); }  ///< of the next step
  double reached() const { return reached_; }
  bool from_start() const { return from_start_; }  ///< the next step, and not from the load reached

  /// How the step to target() went. @returns whether another one is to be tried
  bool add(const NewtonReport& report) {
    const double smallest = std::min(1.0 / 64, largest_ / 4);
    add_work(total_, report);
    if (report.converged || reached_ == 0) total_.relative_residual = report.relative_residual;
    total_.reason = report.reason;
    total_.interrupted = report.interrupted;
    total_.moving = report.moving;
    total_.preconditioner_bytes = std::max(total_.preconditioner_bytes, report.preconditioner_bytes);
    if (report.interrupted) return false;
    const bool was_from_start = std::exchange(from_start_, false);
    if (report.converged) {
      reached_ = target();
      step_ = std::min({2 * step_, 1 - reached_, largest_});
      return reached_ < 1;
    }
    if (aim_ == Aim::look) return false;
    step_ = was_from_start ? largest_ : step_ / 2;
    in_vain_ += report.linear_iterations;
    if (aim_ == Aim::lead) in_vain_ += newton_step_of_few * report.iterations;
    return in_vain_ <= most_in_vain && (was_from_start || step_ >= smallest);
  }

  /// All steps together.
  NewtonReport total() const {
    NewtonReport total = total_;
    total.converged = reached_ == 1;
    if (!total.converged) total.reason = fmt::format("stopped at {:.3g} of the load: {}", reached_, total.reason);
    return total;
  }

private:
  /// Linear iterations of tries that failed, after which no other is made.
  static constexpr std::int64_t most_in_vain = 10'000;
  /// As many a Newton step counts for beside its own where finer cells may go without these: few cells take one
  /// iteration a step, and longer for a step than for that (obstacles).
  static constexpr std::int64_t newton_step_of_few = 30;

  double largest_, step_, reached_ = 0;
  bool from_start_;
  Aim aim_;
  std::int64_t in_vain_ = 0;
  NewtonReport total_;
};

/// The state of a level that load steps reached.
template <class Vector>
struct LoadedState {
  Vector u;
  double load_fraction = 0;
  NewtonReport newton;
  std::optional<Vector> algebraic_error;  ///< of the whole load; see NewtonOutcomeOf
};

/// Newton's method under the loads of a level, cut back and raised in steps where it fails.
/// @param level    has make_start(), largest_load_step(), set_progress(), minimize(), keep(), limit_reached()
/// @param start    of the whole load; nothing: from rest
/// @param aim      look: from the start or not at all
template <class Level, class Vector = typename Level::Vector>
LoadedState<Vector> solve_in_load_steps(Level& level, NewtonOptions options, std::optional<Vector> start,
                                        const LoadProgress& progress, Aim aim = Aim::result) {
  LoadSteps steps(level.largest_load_step(), start.has_value(), aim);
  options.moves_from_rounding = true;
  const bool estimates = options.estimate_error;
  std::optional<Vector> good, failed;  // the state reached, nothing at rest; one that was not
  LoadedState<Vector> out;
  for (bool goes_on = true; goes_on;) {
    const double target = steps.target();
    options.estimate_error = estimates && target == 1;
    const bool from_start = steps.from_start();
    if (!from_start) options.part_of_way = 0;  // which is from a coarser level's solution
    Vector trial = from_start ? std::move(*start) : good ? copy_of(*good) : level.make_start();
    level.set_progress({target});
    const NewtonProgress tell = [&](int iteration, double residual, int linear) {
      if (progress) progress(target, iteration, residual, linear);
    };
    // A start is where another solution let go of what is far.
    const LetsGo lets_go = from_start ? LetsGo::at_once : target == 1 ? LetsGo::at_rest : LetsGo::never;
    NewtonOutcomeOf<Vector> outcome =
        minimize_in_rounds(level, options, trial, tell, target < 1 ? Aim::lead : aim, lets_go);
    if (const std::optional<std::string> through = outcome.converged ? level.gone_through(trial) : std::nullopt) {
      outcome.converged = false;
      outcome.reason = *through;
    }
    if (outcome.converged) {
      level.keep(trial);
      good = std::move(trial);
    } else if (!outcome.interrupted && !from_start) {
      failed = std::move(trial);
    }
    out.algebraic_error = std::move(outcome.algebraic_error);
    goes_on = steps.add(outcome);
  }
  out.load_fraction = steps.reached();
  out.newton = steps.total();
  if (!out.newton.converged)
    for (const std::optional<Vector>* state : {&good, &failed}) {
      const std::string limit = *state ? level.limit_reached(**state, true) : "";
      if (limit.empty()) continue;
      out.newton.reason += "; " + limit;
      break;
    }
  out.u = good ? std::move(*good) : level.make_start();
  return out;
}

}  // namespace hexsolver
