// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "multigrid/multigrid.h"
#include "multigrid/preconditioner_age.h"

namespace hexsolver {

/// A multigrid cycle that is kept for later linearizations while it pays.
class KeptMultigrid {
public:
  struct Ageing {
    PreconditionerAge::Rules rules;
    bool solves_again = false;    ///< with a new cycle, what was not solved within the iterations of an old one
    bool renews_in_place = true;  ///< with the memory and the support springs of the old one
  };

  /// All must outlive this.
  KeptMultigrid(const Hierarchy& hierarchy, const Potential& potential, const Constraints& constraints, Ageing ageing)
      : hierarchy_(hierarchy), potential_(potential), constraints_(constraints), ageing_(ageing), age_(ageing.rules) {}

  /// To be called before the potential is linearized anew: the cycle is worn if the change is large, and its memory
  /// given back if it is not to be used again.
  void expect(bool is_near);

  /// Solves with the cycle there is or a new one. Where a kept one meets negative curvature it may be its own: a new
  /// one is made. Where the cycle itself is not positive it smooths carefully.
  /// @param potential  linearized
  ConjugateGradients::Outcome solve(ConjugateGradients& conjugate_gradients, const NodeVector& b,
                                    const ConjugateGradients::Options& options, NodeVector& d);

  /// z = M^-1 r by the cycle there is, or a new one; false if that is not positive.
  bool apply(const NodeVector& r, NodeVector& z);

  /// The cycle there is, if any, is of no use: other cells share Hessians now.
  void forget() {
    multigrid_.reset();
    age_.wear_out();
  }

  bool is_there() const noexcept { return multigrid_ != nullptr; }
  int times_made() const noexcept { return times_made_; }
  double set_up_seconds() const noexcept { return set_up_seconds_; }
  std::size_t bytes() const { return multigrid_ ? multigrid_->bytes() : 0; }

private:
  void renew();

  const Hierarchy& hierarchy_;
  const Potential& potential_;
  const Constraints& constraints_;
  Ageing ageing_;
  std::unique_ptr<Multigrid> multigrid_;
  bool is_careful_ = false;  ///< the cycle there is smooths so
  PreconditionerAge age_;
  int times_made_ = 0;
  double set_up_seconds_ = 0;
};

}  // namespace hexsolver
