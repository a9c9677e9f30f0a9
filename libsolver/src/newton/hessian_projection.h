// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "terms/term.h"

namespace hexsolver {

/// How much of the Hessian's negative curvature Newton's method projects out, from none (Hessian::exact) to all of it.
/// The projected Hessian makes every step lead down, but steps are small where the body buckles or folds. With too
/// little of the projection conjugate gradients meet negative curvature.
class HessianProjection {
public:
  enum class Start {
    projected,  ///< all of it at first, then as little as steps allow: from far away
    exact       ///< none, and all of it for those steps that meet negative curvature: from nearby
  };
  explicit HessianProjection(Start start = Start::projected) : starts_exact_(start == Start::exact) {
    if (starts_exact_) now_ = Hessian::exact;
  }

  double now() const { return now_; }
  bool is_full() const { return now_ == Hessian::projected; }

  /// More, after negative curvature was met.
  void add() {
    if (starts_exact_) {
      now_ = Hessian::projected;
      return;
    }
    if (now_ == Hessian::exact)
      exact_below_ *= 0.1;
    else
      enough_ = std::min(Hessian::projected, 2 * enough_);
    now_ = enough_;
  }

  /// After a step: a full one deserves less; one to a small residual is worth a try with the exact Hessian.
  void adapt(bool full_step, double relative_residual) {
    if (starts_exact_) {
      now_ = Hessian::exact;
      return;
    }
    enough_ = full_step ? std::max(least, enough_ / 2) : std::min(Hessian::projected, 2 * enough_);
    now_ = full_step && relative_residual < exact_below_ ? Hessian::exact : enough_;
  }

private:
  static constexpr double least = 0.25;
  bool starts_exact_;
  double enough_ = Hessian::projected, now_ = Hessian::projected;
  double exact_below_ = 1e-2;  ///< residual
};

}  // namespace hexsolver
