// SPDX-License-Identifier: Apache-2.0
#include "equilibrium/rest_level.h"

#include "linear/anderson.h"

namespace hexsolver {
namespace {

/// What converges takes 3 to 10; more of the load at once than that leads astray.
constexpr int most_iterations = 10;

constexpr const char* too_soft = "no shape without load is found (is the material too soft for this load?)";

}  // namespace

RotatingCells RestLevel::build(Elasticity elasticity, const CoarseStart<RestLevel>* start, NodeVector& to_rest) {
  if (!start) return LocalLevel::build(elasticity, nullptr, to_rest);
  const CoarseStart<LocalLevel> from{start->level, start->u, start->rotating_above};
  return LocalLevel::build(elasticity, &from, to_rest);
}

void RestLevel::set_progress(const Progress& progress) {
  fraction_ = progress.fraction;
  LocalLevel::set_progress(progress);
}

RestEquations RestLevel::equations() {
  return {problem().hierarchy(), mutable_problem().potential(), mutable_problem().elastic(), problem().constraints()};
}

NewtonOutcome RestLevel::minimize(const NewtonOptions& options, NodeVector& to_rest, const NewtonProgress& progress) {
  const bool by_newton = problem().scene().loaded->method == RestMethod::newton;
  NewtonOutcome out =
      by_newton ? find_by_newton(options, to_rest, progress) : find_by_fixed_point(options, to_rest, progress);
  if (!out.converged) return out;
  mutable_problem().set_rest(to_rest);
  if (fraction_ == 1) shapes_[level()] = to_rest;
  return out;
}

NewtonOutcome RestLevel::find_by_newton(const NewtonOptions& options, NodeVector& to_rest,
                                        const NewtonProgress& progress) {
  RestEquations of_rest = equations();
  NewtonOptions limited = options;
  limited.max_iterations = most_iterations;
  NewtonOutcome out = minimize_on(of_rest, limited, to_rest, progress);
  if (out.end == NewtonEnd::no_descent || out.end == NewtonEnd::too_many_iterations) out.reason = too_soft;
  return out;
}

/// Sellier, Struct. Multidiscip. Optim. 43 (2011) 421: what the loads move the body away from the lattice is taken off
/// its rest.
NewtonOutcome RestLevel::find_by_fixed_point(const NewtonOptions& options, NodeVector& to_rest,
                                             const NewtonProgress& progress) {
  constexpr int most_rounds = 60, most_halvings = 6;
  constexpr std::size_t remembered = 6;
  RestEquations of_rest = equations();
  Anderson anderson(remembered);
  NewtonOutcome out;
  NodeVector residual, support_step;
  if (!of_rest.lift(to_rest, support_step)) to_rest += support_step;
  NewtonOptions forward = options;
  forward.estimate_error = false;
  for (int round = 0;; ++round) {
    const double magnitude = of_rest.gradient(to_rest, residual);
    of_rest.project(residual);
    out.relative_residual = magnitude == 0 ? 0 : residual.norm() / (magnitude + of_rest.rounding() / options.tolerance);
    out.converged = out.relative_residual <= options.tolerance;
    out.reason = out.converged ? reason_of(NewtonEnd::converged, true)
                               : "the fixed point gets no nearer (inverse = \"newton\" goes further)";
    if (progress && round > 0) progress(round, out.relative_residual, out.linear_iterations);
    if (out.converged || round == most_rounds || !std::isfinite(out.relative_residual)) break;
    mutable_problem().set_rest(to_rest);
    NodeVector u = make_zero();
    const NewtonOutcome moved = LocalLevel::minimize(forward, u, {});
    add_work(out, moved);
    out.preconditioner_bytes = std::max(out.preconditioner_bytes, moved.preconditioner_bytes);
    out.interrupted = moved.interrupted;
    if (!moved.converged) {
      out.reason = moved.reason;
      break;
    }
    NodeVector next = anderson.next(to_rest, -u), forces;
    for (int n = 0; n < most_halvings; ++n) {  // what is inside out comes halfway back
      of_rest.gradient(next, forces);
      if (forces.allFinite()) break;
      next = (next + to_rest) / 2;
    }
    to_rest = next;
  }
  out.end = out.interrupted ? NewtonEnd::interrupted : out.converged ? NewtonEnd::converged : NewtonEnd::no_descent;
  return out;
}

LevelMeasures RestLevel::measures(const NodeVector& to_rest) {
  mutable_problem().set_rest(to_rest);
  return LocalLevel::measures(make_zero());
}

std::string RestLevel::limit_reached(const NodeVector& /*to_rest*/, bool nearly) const {
  const Scene& scene = problem().scene();
  if (nearly && scene.loaded->method == RestMethod::newton && scene.elasticity == Elasticity::neo_hookean &&
      scene.volumetric == Volumetric::mean)
    return "neo-Hookean cells of mean dilatation fold where they are pulled apart; law = \"stable-neo-hookean\" or "
           "volumetric = \"full\" bear more";
  return LocalLevel::limit_reached(make_zero(), nearly);
}

}  // namespace hexsolver
