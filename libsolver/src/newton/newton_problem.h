// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "linear/conjugate_gradients.h"
#include "newton/fields.h"

namespace hexsolver {

using LinearEnd = ConjugateGradients::End;

struct LinearOutcome {
  int iterations = 0;
  LinearEnd end = LinearEnd::solved;  ///< negative curvature: the solution is the best before it was met, or zero
};

/// How sharply the linear equations of a Newton step are to be solved.
template <class Vector>
struct LinearGoal {
  double relative_tolerance = 0;  ///< the linear residual over the right side
  /// By what factor the residual after the step is still too large; empty: not asked. Of linear problems, whose one
  /// step is to be the solution.
  std::function<double(const Vector& step)> excess;
  /// Whether the step is expected to change the Hessian by little, so that preconditioners may be kept.
  bool is_near = false;
  bool is_first = false;  ///< of the steps of a run
};

/// What Newton's method asks of a discrete problem: minimise the energy W(u) under H u = c. A problem is one level of
/// one process, of many processes, a step of a motion, or of tetrahedra.
///
/// Members that many processes share are called by all of them.
template <class Vector>
class NewtonProblem {
public:
  virtual ~NewtonProblem() = default;

  virtual Vector make_field() const = 0;  ///< to work with, of any values

  virtual bool is_linear() const = 0;        ///< the gradient, in u
  virtual bool is_conservative() const = 0;  ///< false: forces are no gradient, energy() is only a measure

  virtual double energy(const Vector& u) = 0;  ///< [N mm]

  /// gradient = dW/du. @returns the norm of the absolute values that it sums up [N]
  virtual double gradient(const Vector& u, Vector& gradient) = 0;

  virtual double rounding() const = 0;                 ///< size of the rounding errors in a gradient [N]
  virtual double rounding(const Vector& u) const = 0;  ///< likewise, at u
  virtual double energy_rounding() const = 0;          ///< size of those in an energy [N mm]

  /// By what a line search of forces without energy is to make a projected gradient smaller.
  virtual double measure(const Vector& projected_gradient) const { return norm(projected_gradient); }

  /// How large a displacement is, to compare two of them.
  virtual double size(const Vector& displacement) const { return norm(displacement); }

  /// The resultant of a projected gradient, which is that of all forces on the body, beside the loads; 0 without any.
  virtual double unbalanced(const Vector& /*projected_gradient*/) const { return 0; }

  virtual void project(Vector& v) const = 0;  ///< v <- P v, onto fields that leave the supports alone

  /// step = the smallest that brings the supports to their places. @returns whether it is nothing beside u
  virtual bool lift(const Vector& u, Vector& step) = 0;

  /// The part of a step from u, at most 1, that may be tried.
  virtual double longest_step(const Vector& /*u*/, const Vector& /*step*/) { return 1; }

  /// Prepare apply() and solve() at u.
  /// @param projection  see HessianProjection
  virtual void linearize(const Vector& u, double projection, bool is_near) = 0;

  virtual void apply(const Vector& x, Vector& y) const = 0;  ///< y = H x

  /// P H P step = P right_side.
  virtual LinearOutcome solve(const Vector& right_side, const LinearGoal<Vector>& goal, Vector& step) = 0;

  /// step = what one more step at u would be, about, by one application of the preconditioner; false if there is none.
  virtual bool precondition(const Vector& /*u*/, double /*projection*/, const Vector& /*residual*/, Vector& /*step*/) {
    return false;
  }
};

}  // namespace hexsolver
