// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "level/level_problem.h"
#include "multigrid/kept_multigrid.h"
#include "newton/newton_problem.h"

namespace hexsolver {

/// The equations of a substep on one level; its potential has inertia. Linear equations are solved as
/// [dynamics] asks. After the first substep it asks for no memory.
class StepEquations final : public NewtonProblem<NodeVector> {
public:
  /// @param problem  with its potential; must outlive this
  StepEquations(LevelProblem& problem, const Dynamics& settings);

  /// @param h          of implicit Euler or its like [s]; another one makes another matrix
  /// @param predictor  the step to search first, of the first Newton step; must outlive the substep
  void begin(double h, const NodeVector& predictor);

  /// The potential has other terms than before.
  void forget_preconditioner() { multigrid_.forget(); }

  NodeVector make_field() const override { return {}; }  // sized when it is first written to
  bool is_linear() const override { return potential_.is_linear(); }
  bool is_conservative() const override { return potential_.is_conservative(); }
  double energy(const NodeVector& u) override;
  double longest_step(const NodeVector& u, const NodeVector& step) override { return potential_.longest_step(u, step); }
  double gradient(const NodeVector& u, NodeVector& gradient) override;
  double rounding() const override { return potential_.rounding(); }
  double rounding(const NodeVector& /*u*/) const override { return rounding(); }
  double energy_rounding() const override { return potential_.energy_rounding(); }
  void project(NodeVector& v) const override { constraints_.project(v); }
  bool lift(const NodeVector& u, NodeVector& step) override;
  void linearize(const NodeVector& u, double projection, bool is_near) override;
  void apply(const NodeVector& x, NodeVector& y) const override { potential_.apply(x, y); }
  LinearOutcome solve(const NodeVector& right_side, const LinearGoal<NodeVector>& goal, NodeVector& step) override;

  const NodeVector& last_gradient() const noexcept { return gradient_; }  ///< of the last gradient(), unprojected [N]
  int times_made() const noexcept { return multigrid_.times_made(); }     ///< preconditioners
  std::size_t preconditioner_bytes() const { return multigrid_.bytes(); }

private:
  Potential& potential_;
  const Constraints& constraints_;
  Dynamics settings_;
  KeptMultigrid multigrid_;
  BlockJacobi jacobi_;
  ConjugateGradients conjugate_gradients_;
  double h_ = 0, made_for_ = 0;  ///< of this substep, and of the last linearization [s]
  const NodeVector* predictor_ = nullptr;
  NodeVector gradient_, magnitude_;
};

}  // namespace hexsolver
