// SPDX-License-Identifier: Apache-2.0
#include "multigrid/kept_multigrid.h"

#include <utility>

#include "core/stopwatch.h"

namespace hexsolver {

using End = ConjugateGradients::End;

void KeptMultigrid::expect(bool is_near) {
  if (!is_near || !multigrid_ || !multigrid_->is_positive()) age_.wear_out();
  if (age_.is_worn() && !ageing_.renews_in_place) multigrid_.reset();
}

void KeptMultigrid::renew() {
  const Stopwatch watch;
  if (multigrid_ && ageing_.renews_in_place) {
    multigrid_->update();
  } else {
    multigrid_.reset();
    multigrid_ = std::make_unique<Multigrid>(hierarchy_, potential_, constraints_);
  }
  set_up_seconds_ += watch.seconds();
  ++times_made_;
  is_careful_ = false;
  age_.renew();
}

ConjugateGradients::Outcome KeptMultigrid::solve(ConjugateGradients& conjugate_gradients, const NodeVector& b,
                                                 const ConjugateGradients::Options& options, NodeVector& d) {
  ConjugateGradients::Outcome sum;
  for (bool is_new = false;;) {
    if (age_.is_worn() || !multigrid_) {
      renew();
      is_new = true;
    }
    ConjugateGradients::Options now = options;
    if (!is_new)
      now.most_iterations =
          age_.most_iterations(options.most_iterations, options.relative_tolerance, static_cast<bool>(options.excess));
    ConjugateGradients::Outcome outcome{0, End::negative_curvature};
    if (multigrid_->is_positive())
      outcome = conjugate_gradients.solve(potential_, constraints_, multigrid_.get(), b, now, d);
    else
      d.setZero(b.size());
    sum.iterations += outcome.iterations;
    sum.reduction = outcome.reduction;
    sum.product_seconds += outcome.product_seconds;
    sum.preconditioner_seconds += outcome.preconditioner_seconds;
    if (outcome.end == End::indefinite_preconditioner) {
      if (!std::exchange(is_careful_, true)) {
        multigrid_->smooth_carefully();
        continue;
      }
      outcome.end = End::negative_curvature;
    }
    sum.end = outcome.end;
    age_.judge(outcome.end == End::solved, outcome.iterations, outcome.reduction);
    const bool ran_out = now.most_iterations < options.most_iterations && outcome.iterations == now.most_iterations;
    const bool retries = !is_new && (outcome.end == End::negative_curvature || (ran_out && ageing_.solves_again));
    if (!retries) return sum;
    age_.wear_out();
    if (!ageing_.renews_in_place) multigrid_.reset();
  }
}

bool KeptMultigrid::apply(const NodeVector& r, NodeVector& z) {
  if (!multigrid_) renew();
  if (!multigrid_->is_positive()) return false;
  multigrid_->apply(r, z);
  return true;
}

}  // namespace hexsolver
