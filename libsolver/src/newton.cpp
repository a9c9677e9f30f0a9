// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/newton.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "clamping.h"
#include "hexsolver/multigrid.h"
#include "stopwatch.h"

namespace hexsolver {

NewtonSeconds& NewtonSeconds::operator+=(const NewtonSeconds& other) {
  forces += other.forces;
  linearize += other.linearize;
  set_up += other.set_up;
  cycles += other.cycles;
  products += other.products;
  return *this;
}

namespace {

using Linear = ConjugateGradients::End;
using LinearOutcome = ConjugateGradients::Outcome;

struct Residual {
  NodeVector gradient;  ///< projected
  double relative = 0;
};

/// One call of minimize().
class Minimizer {
public:
  Minimizer(const Hierarchy& hierarchy, Potential& potential, const Constraints& constraints,
            const NewtonOptions& options)
      : hierarchy_(hierarchy),
        potential_(potential),
        constraints_(constraints),
        options_(options),
        rounding_(potential.rounding()) {}

  NewtonReport run(NodeVector& u, const NewtonProgress& progress);

private:
  NewtonReport descend(NodeVector& u, const NewtonProgress& progress);
  Residual residual(const NodeVector& u);
  double energy(const NodeVector& u);
  double rounding(const NodeVector& u) const;
  double energy_rounding(double energy, const NodeVector& step) const;
  bool prepare(const NodeVector& u, double clamping, bool is_near);
  LinearOutcome find_step(const NodeVector& u, const Residual& now, const NodeVector& support_step, Clamping& clamping,
                          NodeVector& step);
  void judge_preconditioner(const LinearOutcome& outcome);
  double forcing(const Residual& now, bool supports_hold) const;
  int enough_iterations(double forcing) const;
  std::optional<NodeVector> move_supports(const NodeVector& u, const NodeVector& step);
  std::optional<double> search_line(NodeVector& u, Residual& now, const NodeVector& step);

  const Hierarchy& hierarchy_;
  Potential& potential_;
  const Constraints& constraints_;
  const NewtonOptions& options_;
  static constexpr double near = 3e-2;  ///< residual, below which steps turn cells by little
  double rounding_;
  NewtonSeconds seconds_;
  std::unique_ptr<const Multigrid> preconditioner_;
  std::optional<double> rate_;  ///< log |r| per iteration of the first solution with it
  bool is_worn_ = false;
  ConjugateGradients conjugate_gradients_;
};

/// Size of the rounding errors in a gradient [N]. Cells that do not turn add up displacements alone, which may be far
/// smaller than the places of nodes.
double Minimizer::rounding(const NodeVector& u) const {
  const double in_half_edges =
      u.lpNorm<Eigen::Infinity>() / (0.5 * potential_.mesh().edges().colwise().norm().minCoeff());
  return potential_.is_linear() ? std::min(1.0, in_half_edges) * rounding_ : rounding_;
}

/// |P g| over the sum of absolute cell forces and loads; forces of the size of rounding errors count as balanced.
Residual Minimizer::residual(const NodeVector& u) {
  const Stopwatch watch;
  potential_.move_to(u);
  Residual residual;
  NodeVector magnitude;
  potential_.gradient(u, residual.gradient, magnitude);
  constraints_.project(residual.gradient);
  const double balanced = magnitude.norm() + rounding(u) / options_.tolerance;
  residual.relative = balanced == 0 ? 0 : residual.gradient.norm() / balanced;
  seconds_.forces += watch.seconds();
  return residual;
}

double Minimizer::energy(const NodeVector& u) {
  const Stopwatch watch;
  potential_.move_to(u);
  const double energy = potential_.energy(u);
  seconds_.forces += watch.seconds();
  return energy;
}

/// By how much energies may differ by rounding alone.
double Minimizer::energy_rounding(double energy, const NodeVector& step) const {
  return 1e-13 * std::abs(energy) + rounding_ * step.lpNorm<Eigen::Infinity>();
}

/// Linearize at u. Near the solution the coarse levels of the last step are as good, until iterations tell otherwise.
/// @returns whether they are kept
bool Minimizer::prepare(const NodeVector& u, double clamping, bool is_near) {
  const bool keeps = is_near && preconditioner_ && !is_worn_ && preconditioner_->is_positive();
  if (!keeps) preconditioner_.reset();
  const Stopwatch of_linearize;
  potential_.linearize(u, clamping);
  seconds_.linearize += of_linearize.seconds();
  if (keeps) return true;
  const Stopwatch of_set_up;
  rate_.reset();
  preconditioner_ = std::make_unique<const Multigrid>(hierarchy_, potential_, constraints_);
  seconds_.set_up += of_set_up.seconds();
  return false;
}

/// The Newton step beyond the one that brings the supports to their places; where the exact Hessian is not positive,
/// that of the clamped one. An empty step: the clamped one is not positive either.
LinearOutcome Minimizer::find_step(const NodeVector& u, const Residual& now, const NodeVector& support_step,
                                   Clamping& clamping, NodeVector& step) {
  const bool supports_hold = support_step.size() == 0;
  int iterations = 0;
  while (true) {
    const bool keeps = prepare(u, clamping.now(), supports_hold && now.relative < near);
    step.resize(0);
    LinearOutcome outcome{0, Linear::negative_curvature};
    if (preconditioner_->is_positive()) {
      NodeVector b = -now.gradient;
      if (!supports_hold) {
        potential_.apply(support_step, b);
        b = -now.gradient - b;
      }
      const double relative_tolerance = forcing(now, supports_hold);
      ConjugateGradients::Options linear{keeps ? enough_iterations(relative_tolerance) : options_.max_linear_iterations,
                                         relative_tolerance,
                                         {},
                                         options_.interrupt};
      if (potential_.is_linear())
        linear.excess = [&](const NodeVector& d) {
          NodeVector end = u + d;
          if (!supports_hold) end += support_step;
          return residual(end).relative / options_.tolerance;
        };
      outcome = conjugate_gradients_.solve(potential_, constraints_, preconditioner_.get(), b, linear, step);
      seconds_.cycles += outcome.preconditioner_seconds;
      seconds_.products += outcome.product_seconds;
      judge_preconditioner(outcome);
    }
    iterations += outcome.iterations;
    if (keeps && outcome.end == Linear::negative_curvature) continue;  // it may be that of what was kept
    if (outcome.end != Linear::negative_curvature || clamping.now() == Hessian::clamped)
      return {iterations, outcome.end};
    clamping.add();
  }
}

void Minimizer::judge_preconditioner(const LinearOutcome& outcome) {
  constexpr double worth_keeping = 0.7;
  is_worn_ = true;
  if (outcome.end != Linear::solved || outcome.iterations == 0) return;
  const double rate = std::log(outcome.reduction) / outcome.iterations;
  if (!rate_) rate_ = rate;
  is_worn_ = rate > worth_keeping * *rate_;
}

/// Solve as sharply as the next residual can use; a linear problem at once.
double Minimizer::forcing(const Residual& now, bool supports_hold) const {
  const double needed = 0.1 * options_.tolerance / now.relative;
  if (potential_.is_linear()) return 0.1;
  return supports_hold ? std::max(std::min(now.relative * 10, 0.05), needed) : std::max(1e-3, 0.1 * options_.tolerance);
}

/// With a preconditioner of an earlier step: where it has become so poor, the step so far is taken and the next one has
/// a new one.
int Minimizer::enough_iterations(double forcing) const {
  if (potential_.is_linear() || !rate_ || !(*rate_ < 0)) return options_.max_linear_iterations;
  return std::min(options_.max_linear_iterations, 5 + static_cast<int>(2 * std::log(forcing) / *rate_));
}

/// Backtrack from u + step until the energy falls enough (Armijo), or the residual where there is no energy.
/// @returns the part of the step taken; nothing if no part helps
std::optional<double> Minimizer::search_line(NodeVector& u, Residual& now, const NodeVector& step) {
  const bool has_energy = potential_.is_conservative();
  const double before = energy(u);
  const double slope = now.gradient.dot(step);
  const double shortest = has_energy ? 1e-4 : 1e-2;
  for (double length = 1; length >= shortest; length /= 2) {
    NodeVector trial = u + length * step;
    // Near the solution energies differ by rounding only.
    if (has_energy && !(energy(trial) <= before + 1e-4 * length * slope + energy_rounding(before, step))) continue;
    Residual next = residual(trial);
    if (!has_energy && !(next.gradient.norm() < (1 - 1e-4 * length) * now.gradient.norm())) continue;
    u = std::move(trial);
    now = std::move(next);
    return length;
  }
  return {};
}

/// u + step, or a part of the step where the law has no meaning at its end; nothing if no part is possible.
std::optional<NodeVector> Minimizer::move_supports(const NodeVector& u, const NodeVector& step) {
  constexpr double shortest = 1.0 / 64;
  for (double length = 1; length >= shortest; length /= 2) {
    NodeVector end = u + length * step;
    if (potential_.is_linear() || std::isfinite(energy(end))) return end;
  }
  return {};
}

NewtonReport Minimizer::run(NodeVector& u, const NewtonProgress& progress) {
  NewtonReport report = descend(u, progress);
  report.seconds = seconds_;
  return report;
}

NewtonReport Minimizer::descend(NodeVector& u, const NewtonProgress& progress) {
  NewtonReport report;
  Clamping clamping;
  if (!potential_.is_linear() && !std::isfinite(energy(u))) {
    report.reason = "points of the body are inside out at the start";
    return report;
  }
  Residual now = residual(u);
  while (true) {
    report.relative_residual = now.relative;
    NodeVector support_step = constraints_.lift(u);
    const bool supports_hold = constraints_.hold(support_step, u);
    if (supports_hold && now.relative <= options_.tolerance) break;
    if (report.iterations == options_.max_iterations) {
      report.reason = "too many Newton iterations (does the body buckle or fold there?)";
      return report;
    }
    ++report.iterations;

    if (supports_hold) support_step.resize(0);
    NodeVector step;
    const LinearOutcome linear = find_step(u, now, support_step, clamping, step);
    report.linear_iterations += linear.iterations;
    report.preconditioner_bytes = preconditioner_->bytes();
    if (linear.end == Linear::interrupted) {
      report.reason = "interrupted";
      report.interrupted = true;
      return report;
    }
    if (step.size() == 0 || (linear.end == Linear::negative_curvature && step.isZero(0))) {
      report.reason = "the stiffness matrix is not positive definite (missing supports?)";
      return report;
    }

    if (!supports_hold) {
      const std::optional<NodeVector> moved = move_supports(u, support_step + step);
      if (!moved) {
        report.reason = "under the prescribed displacements points of the body would turn inside out";
        return report;
      }
      u = *moved;
      now = residual(u);
    } else {
      const std::optional<double> length = search_line(u, now, step);
      if (!length) {
        report.reason = potential_.is_conservative() ? "no step lowers the energy"
                                                     : "no step lowers the residual (its forces are no gradient; "
                                                       "rotation = \"polar\" has one)";
        return report;
      }
      clamping.adapt(*length == 1, now.relative);
    }
    if (!u.allFinite()) {
      report.reason = "the displacement is not finite";
      return report;
    }
    if (progress) progress(report.iterations, now.relative, linear.iterations);
  }
  report.converged = true;
  report.reason = "residual below tolerance";
  if (!options_.estimate_remaining) return report;
  if (preconditioner_)
    potential_.linearize(u, clamping.now());
  else
    prepare(u, Hessian::clamped, false);
  if (preconditioner_->is_positive()) preconditioner_->apply(now.gradient, report.remaining);
  return report;
}

}  // namespace

NewtonReport minimize(const Hierarchy& hierarchy, Potential& potential, const Constraints& constraints,
                      const NewtonOptions& options, NodeVector& u, const NewtonProgress& progress) {
  return Minimizer(hierarchy, potential, constraints, options).run(u, progress);
}

}  // namespace hexsolver
