// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/newton.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace hexsolver {
namespace {

struct LinearOutcome {
  int iterations = 0;
  bool positive = true;  ///< no direction of negative curvature was met
};

/// Preconditioned conjugate gradients for P A P d = P b in the range of P, from d = 0.
/// Ends early on a direction of negative curvature; d is then the best so far.
LinearOutcome solve_linear(const Elastic& elastic, const Constraints& constraints, const Multigrid& preconditioner,
                           const NodeVector& b, double relative_tolerance, int max_iterations, NodeVector& d) {
  d.setZero(b.size());
  NodeVector r = b, z, p, q;
  constraints.project(r);
  const double target = relative_tolerance * r.norm();
  double rz = 0;
  LinearOutcome outcome;
  while (r.norm() > target && outcome.iterations < max_iterations) {
    preconditioner.apply(r, z);
    const double rz_next = r.dot(z);
    if (!(rz_next > 0)) {
      outcome.positive = false;
      return outcome;
    }
    if (outcome.iterations == 0)
      p = z;
    else
      p = z + rz_next / rz * p;
    rz = rz_next;
    elastic.apply(p, q);
    constraints.project(q);
    const double curvature = p.dot(q);
    ++outcome.iterations;
    if (!(curvature > 0)) {
      outcome.positive = false;
      return outcome;
    }
    const double alpha = rz / curvature;
    d += alpha * p;
    r -= alpha * q;
  }
  return outcome;
}

struct Residual {
  NodeVector gradient;  ///< projected
  double relative = 0;
};

/// Elastic energy less the work of the external forces, in the range of P.
class Objective {
public:
  Objective(const Elastic& elastic, const Constraints& constraints, const NodeVector& forces, double fraction,
            double tolerance)
      : elastic_(elastic), constraints_(constraints), tolerance_(tolerance) {
    if (forces.size() > 0) forces_ = fraction * forces;
  }

  double energy(const NodeVector& u) const { return elastic_.energy(u) - work(u); }

  /// By how much energies may differ by rounding alone.
  double energy_rounding(const NodeVector& u, const NodeVector& step) const {
    return 1e-13 * (std::abs(energy(u)) + std::abs(work(u))) + elastic_.rounding() * step.lpNorm<Eigen::Infinity>();
  }

  /// |P g| over the sum of absolute cell forces and loads; forces of the size of rounding errors count as balanced.
  Residual residual(const NodeVector& u) const {
    Residual residual;
    NodeVector magnitude;
    elastic_.gradient(u, residual.gradient, magnitude);
    if (forces_.size() > 0) {
      residual.gradient -= forces_;
      magnitude += forces_.cwiseAbs();
    }
    constraints_.project(residual.gradient);
    residual.relative = residual.gradient.norm() / (magnitude.norm() + elastic_.rounding() / tolerance_);
    return residual;
  }

private:
  double work(const NodeVector& u) const { return forces_.size() > 0 ? forces_.dot(u) : 0; }

  const Elastic& elastic_;
  const Constraints& constraints_;
  NodeVector forces_;
  double tolerance_;
};

}  // namespace

NewtonReport minimize(const Hierarchy& hierarchy, Elastic& elastic, const Constraints& constraints,
                      const NodeVector& forces, double fraction, const NewtonOptions& options, NodeVector& u,
                      const NewtonProgress& progress) {
  const Objective objective(elastic, constraints, forces, fraction, options.tolerance);
  NewtonReport report;
  Hessian which = Hessian::clamped;
  Residual now = objective.residual(u);
  NodeVector support_step = constraints.lift(u, fraction);
  bool supports_hold = support_step.lpNorm<Eigen::Infinity>() < 1e-9;
  while (report.iterations < options.max_iterations) {
    report.relative_residual = now.relative;
    if (supports_hold && now.relative <= options.tolerance) {
      report.converged = true;
      report.reason = "residual below tolerance";
      return report;
    }
    ++report.iterations;

    // Solve as sharply as the next residual can use; a linear problem at once, and what is then left but once more.
    const double needed = 0.1 * options.tolerance / now.relative;
    const double forcing = elastic.is_linear() ? (supports_hold ? std::min(needed, 0.1) : options.tolerance)
                           : supports_hold     ? std::clamp(now.relative * 10, needed, 0.05)
                                               : std::max(1e-3, 0.1 * options.tolerance);
    NodeVector step;
    int linear_iterations = 0;
    for (bool solved = false; !solved;) {
      elastic.linearize(u, which);
      const Multigrid preconditioner(hierarchy, elastic, constraints);
      LinearOutcome outcome{0, preconditioner.is_positive()};
      if (outcome.positive) {
        NodeVector b = -now.gradient;
        if (!supports_hold) {
          elastic.apply(support_step, b);
          b = -now.gradient - b;
        }
        outcome = solve_linear(elastic, constraints, preconditioner, b, forcing, options.max_linear_iterations, step);
        linear_iterations += outcome.iterations;
      }
      solved = outcome.positive || which == Hessian::clamped;
      if (!solved) which = Hessian::clamped;
      if (!outcome.positive && solved && step.size() == 0) {
        report.reason = "the stiffness matrix is not positive definite (missing supports?)";
        return report;
      }
    }
    report.linear_iterations += linear_iterations;

    if (!supports_hold) {
      u += support_step + step;
      now = objective.residual(u);
    } else {
      const double energy = objective.energy(u);
      const double slope = now.gradient.dot(step);
      double length = 1;
      Residual next;
      NodeVector trial;
      while (true) {
        trial = u + length * step;
        next = objective.residual(trial);
        // Near the solution energies differ by rounding only.
        const double slack = objective.energy_rounding(u, step);
        if (objective.energy(trial) <= energy + 1e-4 * length * slope + slack) break;
        length /= 2;
        if (length < 1e-4) {
          report.reason = "no step lowers the energy";
          return report;
        }
      }
      // A full step with the clamped matrix to a small residual: the exact one is worth a try.
      which = length == 1 && next.relative < 1e-2 ? Hessian::exact : Hessian::clamped;
      u = std::move(trial);
      now = std::move(next);
    }
    if (!u.allFinite()) {
      report.reason = "the displacement is not finite";
      return report;
    }
    support_step = constraints.lift(u, fraction);
    supports_hold = support_step.lpNorm<Eigen::Infinity>() < 1e-9 * std::max(1.0, u.lpNorm<Eigen::Infinity>());
    if (progress) progress(report.iterations, now.relative, linear_iterations);
  }
  report.relative_residual = now.relative;
  report.converged = supports_hold && now.relative <= options.tolerance;
  report.reason = report.converged ? "residual below tolerance" : "too many Newton iterations";
  return report;
}

}  // namespace hexsolver
