// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "hexsolver/newton.h"

namespace hexsolver {

/// The load of a level: all at once where Newton manages that, else cut back and raised in steps.
class LoadSteps {
public:
  /// @param largest    part of the load that a step may be
  /// @param has_start  whether the first step is the whole load, from a coarser level's solution
  LoadSteps(double largest, bool has_start)
      : largest_(largest), step_(has_start ? 1 : largest), from_start_(has_start) {}

  double target() const { return std::min(1.0, reached_ + step_); }  ///< of the next step
  double reached() const { return reached_; }
  bool from_start() const { return from_start_; }  ///< the next step, and not from the load reached

  /// How the step to target() went. @returns whether another one is to be tried
  bool add(NewtonReport report) {
    constexpr double smallest = 1.0 / 64;
    total_.iterations += report.iterations;
    total_.linear_iterations += report.linear_iterations;
    if (report.converged || reached_ == 0) total_.relative_residual = report.relative_residual;
    total_.reason = std::move(report.reason);
    total_.interrupted = report.interrupted;
    total_.preconditioner_bytes = std::max(total_.preconditioner_bytes, report.preconditioner_bytes);
    total_.remaining = std::move(report.remaining);
    total_.seconds += report.seconds;
    if (report.interrupted) return false;
    const bool was_from_start = std::exchange(from_start_, false);
    if (report.converged) {
      reached_ = target();
      step_ = std::min({2 * step_, 1 - reached_, largest_});
      return reached_ < 1;
    }
    step_ = was_from_start ? largest_ : step_ / 2;
    return was_from_start || step_ >= smallest;
  }

  /// All steps together.
  NewtonReport total() && {
    total_.converged = reached_ == 1;
    if (!total_.converged) total_.reason = fmt::format("stopped at {:.3g} of the load: {}", reached_, total_.reason);
    return std::move(total_);
  }

private:
  double largest_, step_, reached_ = 0;
  bool from_start_;
  NewtonReport total_;
};

}  // namespace hexsolver
