// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "constraints/constraints.h"
#include "multigrid/multigrid.h"
#include "newton/newton.h"

namespace hexsolver {

/// How Newton's method ended, and how far u is from the exact solution.
template <class Vector>
struct NewtonOutcomeOf : NewtonReport {
  NewtonEnd end = NewtonEnd::converged;
  /// What one more step would add, by one V-cycle: an estimate of the algebraic error. Where it converged, if asked.
  std::optional<Vector> algebraic_error;
};
using NewtonOutcome = NewtonOutcomeOf<NodeVector>;

/// Counts the work of another run with it.
inline void add_work(NewtonReport& to, const NewtonReport& other) {
  to.iterations += other.iterations;
  to.linear_iterations += other.linear_iterations;
  to.seconds += other.seconds;
}

/// One run of Newton's method on a problem, told as a report.
template <class Vector>
NewtonOutcomeOf<Vector> minimize(NewtonProblem<Vector>& problem, const NewtonOptions& options, Vector& u,
                                 const NewtonProgress& progress = {}) {
  Newton<Vector> newton(problem, options);
  const NewtonEnd end = newton.run(u, progress);
  NewtonOutcomeOf<Vector> out;
  out.end = end;
  out.converged = is_good(end);
  out.reason = reason_of(end, problem.is_conservative());
  out.interrupted = end == NewtonEnd::interrupted;
  out.iterations = newton.iterations();
  out.linear_iterations = newton.linear_iterations();
  out.relative_residual = newton.relative_residual();
  out.seconds.forces = newton.force_seconds();
  if (end == NewtonEnd::accurate) {
    out.algebraic_error = copy_of(newton.error());
  } else if (out.converged && options.estimate_error) {
    Vector error = problem.make_field();
    if (problem.precondition(u, newton.projection(), newton.projected_gradient(), error))
      out.algebraic_error = std::move(error);
  }
  return out;
}

/// One run on the equations of a level, which tell what they took.
template <class Equations>
NewtonOutcome minimize_on(Equations& equations, const NewtonOptions& options, NodeVector& u,
                          const NewtonProgress& progress) {
  equations.set_limits(options.max_linear_iterations, options.interrupt);
  NewtonOutcome out = minimize<NodeVector>(equations, options, u, progress);
  out.preconditioner_bytes = equations.preconditioner_bytes();
  out.seconds += equations.seconds();
  return out;
}

/// Minimise the potential energy of one level under H u = c from u, by conjugate gradients with one V-cycle.
NewtonOutcome minimize(const Hierarchy& hierarchy, Potential& potential, const Constraints& constraints,
                       const NewtonOptions& options, NodeVector& u, const NewtonProgress& progress = {});

}  // namespace hexsolver
