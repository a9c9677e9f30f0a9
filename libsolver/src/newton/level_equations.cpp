// SPDX-License-Identifier: Apache-2.0
#include "newton/level_equations.h"

#include "newton/minimize.h"

namespace hexsolver {
LevelEquations::LevelEquations(const Hierarchy& hierarchy, Potential& potential, const Constraints& constraints)
    : potential_(potential),
      constraints_(constraints),
      rounding_(potential.rounding()),
      multigrid_(hierarchy, potential, constraints, {ageing_of_newton_steps, false, false}) {}

void LevelEquations::set_limits(int max_linear_iterations, std::function<bool()> interrupt) {
  max_linear_iterations_ = max_linear_iterations;
  interrupt_ = std::move(interrupt);
}

double LevelEquations::energy(const NodeVector& u) {
  potential_.move_to(u);
  return potential_.energy(u);
}

double LevelEquations::gradient(const NodeVector& u, NodeVector& gradient) {
  potential_.move_to(u);
  potential_.gradient(u, gradient, magnitude_);
  return magnitude_.norm();
}

double LevelEquations::rounding(const NodeVector& u) const {
  const double in_half_edges =
      u.lpNorm<Eigen::Infinity>() / (0.5 * potential_.mesh().edges().colwise().norm().minCoeff());
  return potential_.gradient_jump(u) +
         (potential_.adds_displacements_alone() ? std::min(1.0, in_half_edges) * rounding_ : rounding_);
}

double LevelEquations::unbalanced(const NodeVector& projected_gradient) const {
  if (size_of_loads_ == 0) return 0;
  return Eigen::Map<const Eigen::Matrix3Xd>(projected_gradient.data(), 3, projected_gradient.size() / 3)
             .rowwise()
             .sum()
             .norm() /
         size_of_loads_;
}

bool LevelEquations::lift(const NodeVector& u, NodeVector& step) {
  constraints_.lift(u, step);
  return constraints_.hold(step, u);
}

void LevelEquations::linearize(const NodeVector& u, double projection, bool is_near) {
  multigrid_.expect(is_near);
  const Stopwatch watch;
  potential_.linearize(u, projection);
  seconds_.linearize += watch.seconds();
}

LinearOutcome LevelEquations::solve(const NodeVector& right_side, const LinearGoal<NodeVector>& goal,
                                    NodeVector& step) {
  const ConjugateGradients::Options options{max_linear_iterations_, goal.relative_tolerance, goal.excess, interrupt_};
  const ConjugateGradients::Outcome outcome = multigrid_.solve(conjugate_gradients_, right_side, options, step);
  seconds_.cycles += outcome.preconditioner_seconds;
  seconds_.products += outcome.product_seconds;
  return {outcome.iterations, outcome.end};
}

bool LevelEquations::precondition(const NodeVector& u, double projection, const NodeVector& residual,
                                  NodeVector& step) {
  potential_.linearize(u, multigrid_.is_there() ? projection : Hessian::projected);
  return multigrid_.apply(residual, step);
}

NewtonSeconds LevelEquations::seconds() const {
  NewtonSeconds seconds = seconds_;
  seconds.set_up = multigrid_.set_up_seconds();
  return seconds;
}

NewtonOutcome minimize(const Hierarchy& hierarchy, Potential& potential, const Constraints& constraints,
                       const NewtonOptions& options, NodeVector& u, const NewtonProgress& progress) {
  LevelEquations equations(hierarchy, potential, constraints);
  return minimize_on(equations, options, u, progress);
}

}  // namespace hexsolver
