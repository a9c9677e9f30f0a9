// SPDX-License-Identifier: Apache-2.0
#include "newton/rest_equations.h"

#include <Eigen/LU>
#include <algorithm>
#include <limits>

#include "linear/gmres.h"

namespace hexsolver {

RestEquations::RestEquations(const Hierarchy& hierarchy, Potential& potential, ElasticCells& elastic,
                             const Constraints& constraints)
    : potential_(potential),
      elastic_(elastic),
      constraints_(constraints),
      multigrid_(hierarchy, potential, constraints, {ageing_of_newton_steps, false, false}) {
  const NodeVector zero = NodeVector::Zero(static_cast<Eigen::Index>(potential.mesh().num_dofs()));
  potential_.gradient_without(elastic_, zero, loads_, load_magnitude_);
}

void RestEquations::set_limits(int max_linear_iterations, std::function<bool()> interrupt) {
  max_linear_iterations_ = std::min(max_linear_iterations, most_iterations);
  interrupt_ = std::move(interrupt);
}

double RestEquations::gradient(const NodeVector& to_rest, NodeVector& gradient) { return balance(to_rest, gradient); }

double RestEquations::balance(const NodeVector& to_rest, NodeVector& gradient) const {
  if (to_rest.isZero(0) && !elastic_.is_prestretched()) {  // what is at rest on the lattice exerts nothing there
    gradient = -loads_;
    return load_magnitude_.norm();
  }
  const Mesh& mesh = potential_.mesh();
  NodeVector magnitude = NodeVector::Zero(3 * static_cast<Eigen::Index>(mesh.num_all_nodes()));
  gradient.setZero(magnitude.size());
  if (!elastic_.add_gradient_on_lattice(potential_.at_all(to_rest), gradient, magnitude)) {
    gradient.setConstant(to_rest.size(), std::numeric_limits<double>::quiet_NaN());
    return 1;
  }
  mesh.collect(gradient);
  mesh.collect(magnitude);
  gradient = -(gradient + loads_);
  return (magnitude + load_magnitude_).norm();
}

bool RestEquations::lift(const NodeVector& u, NodeVector& step) {
  constraints_.lift(u, step);
  return constraints_.hold(step, u);
}

void RestEquations::linearize(const NodeVector& to_rest, double projection, bool is_near) {
  multigrid_.expect(is_near);
  const Stopwatch watch;
  at_ = to_rest;
  elastic_.set_rest(potential_.at_all(to_rest));
  potential_.linearize(NodeVector::Zero(to_rest.size()), projection);
  balance(at_, gradient_at_);
  average_gradients();
  seconds_.linearize += watch.seconds();
}

void RestEquations::average_gradients() {
  const Mesh& mesh = potential_.mesh();
  to_rest_gradient_.assign(mesh.num_nodes(), Mat3::Zero());
  std::vector<double> volume(mesh.num_nodes(), 0);
  const NodeVector zero = NodeVector::Zero(at_.size());
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const Mat3 f = elastic_.mean_gradient(c, zero).inverse();
    for (std::size_t a = 0; a < 8; ++a) {
      const std::size_t n = mesh.node(c, a);
      to_rest_gradient_[n] += elastic_.model(c).volume * f;
      volume[n] += elastic_.model(c).volume;
    }
  }
  for (std::size_t n = 0; n < volume.size(); ++n) to_rest_gradient_[n] /= volume[n];
}

bool RestEquations::step_for(const NodeVector& right_side, NodeVector& step) const {
  const Stopwatch watch;
  if (!multigrid_.apply(right_side, step)) return false;
  for (std::size_t n = 0; n < to_rest_gradient_.size(); ++n) {
    auto of_node = step.segment<3>(3 * static_cast<Eigen::Index>(n));
    of_node = (to_rest_gradient_[n] * of_node).eval();
  }
  constraints_.project(step);
  seconds_.cycles += watch.seconds();
  return true;
}

double RestEquations::measure(const NodeVector& projected_gradient) const {
  NodeVector step;
  return projected_gradient.allFinite() && step_for(projected_gradient, step) ? step.norm()
                                                                              : std::numeric_limits<double>::infinity();
}

/// By differences over a millionth of a cell.
void RestEquations::apply(const NodeVector& x, NodeVector& y) const {
  constexpr double part = 1e-6;
  const Stopwatch watch;
  const double largest = x.lpNorm<Eigen::Infinity>();
  if (largest == 0) {
    y.setZero(x.size());
    return;
  }
  const double length = part * potential_.mesh().edges().colwise().norm().minCoeff() / largest;
  balance(at_ + length * x, y);
  y = (y - gradient_at_) / length;
  seconds_.products += watch.seconds();
}

LinearOutcome RestEquations::solve(const NodeVector& right_side, const LinearGoal<NodeVector>& goal, NodeVector& step) {
  NodeVector z;
  step.setZero(right_side.size());
  if (!step_for(right_side, z)) return {0, LinearEnd::negative_curvature};
  const GeneralEquation equation{[this](const NodeVector& x, NodeVector& y) {
                                   apply(x, y);
                                   constraints_.project(y);
                                 },
                                 [this](const NodeVector& r, NodeVector& to) { step_for(r, to); }};
  NodeVector projected = right_side;
  constraints_.project(projected);
  const GmresOutcome outcome =
      solve_by_gmres(equation, projected, {goal.relative_tolerance, max_linear_iterations_, interrupt_}, step);
  return {outcome.iterations, outcome.end};
}

bool RestEquations::precondition(const NodeVector& to_rest, double projection, const NodeVector& residual,
                                 NodeVector& step) {
  linearize(to_rest, multigrid_.is_there() ? projection : Hessian::projected, true);
  return step_for(residual, step);
}

NewtonSeconds RestEquations::seconds() const {
  NewtonSeconds seconds = seconds_;
  seconds.set_up = multigrid_.set_up_seconds();
  return seconds;
}

}  // namespace hexsolver
