// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "hexsolver/term.h"

namespace hexsolver {

/// How much of the Hessian's negative curvature is left out. All of it makes every step lead down but small where the
/// body buckles or folds; too little, and conjugate gradients meet negative curvature: as little as goes is kept.
class Clamping {
public:
  double now() const { return now_; }

  /// More, after negative curvature was met.
  void add() {
    if (now_ == Hessian::exact)
      exact_below_ *= 0.1;
    else
      enough_ = std::min(Hessian::clamped, 2 * enough_);
    now_ = enough_;
  }

  /// After a step: a full one deserves less; one to a small residual is worth a try with the exact Hessian.
  void adapt(bool full_step, double relative_residual) {
    enough_ = full_step ? std::max(least, enough_ / 2) : std::min(Hessian::clamped, 2 * enough_);
    now_ = full_step && relative_residual < exact_below_ ? Hessian::exact : enough_;
  }

private:
  static constexpr double least = 0.25;
  double enough_ = Hessian::clamped, now_ = Hessian::clamped;
  double exact_below_ = 1e-2;  ///< residual
};

}  // namespace hexsolver
