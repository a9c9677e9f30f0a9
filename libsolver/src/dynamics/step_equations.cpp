// SPDX-License-Identifier: Apache-2.0
#include "dynamics/step_equations.h"

namespace hexsolver {
namespace {

/// A cycle is made anew once its age has cost what making one does, about eight iterations.
constexpr KeptMultigrid::Ageing ageing_of_motion = {{0, 8, 40}, true, true};

}  // namespace

StepEquations::StepEquations(LevelProblem& problem, const Dynamics& settings)
    : potential_(problem.potential()),
      constraints_(problem.constraints()),
      settings_(settings),
      multigrid_(problem.hierarchy(), problem.potential(), problem.constraints(), ageing_of_motion),
      jacobi_(problem.constraints()) {}

void StepEquations::begin(double h, const NodeVector& predictor) {
  h_ = h;
  predictor_ = &predictor;
}

double StepEquations::energy(const NodeVector& u) {
  potential_.move_to(u);
  return potential_.energy(u);
}

double StepEquations::gradient(const NodeVector& u, NodeVector& gradient) {
  potential_.move_to(u);
  potential_.gradient(u, gradient_, magnitude_);
  gradient = gradient_;
  return magnitude_.norm();
}

bool StepEquations::lift(const NodeVector& u, NodeVector& step) {
  constraints_.lift(u, step);
  return constraints_.hold(step, u);
}

void StepEquations::linearize(const NodeVector& u, double projection, bool /*is_near*/) {
  multigrid_.expect(h_ == made_for_);
  made_for_ = h_;
  potential_.linearize(u, projection);
}

LinearOutcome StepEquations::solve(const NodeVector& right_side, const LinearGoal<NodeVector>& goal, NodeVector& step) {
  ConjugateGradients::Options options;
  options.relative_tolerance = goal.relative_tolerance;
  options.most_iterations = settings_.solver == StepSolver::multigrid ? 200 : 5000;
  if (settings_.solver_iterations > 0) {
    options.relative_tolerance = 1e-14;
    options.most_iterations = settings_.solver_iterations;
  }
  if (goal.is_first) options.first_direction = predictor_;
  ConjugateGradients::Outcome outcome;
  if (settings_.solver == StepSolver::multigrid) {
    outcome = multigrid_.solve(conjugate_gradients_, right_side, options, step);
  } else {
    const bool is_jacobi = settings_.solver == StepSolver::jacobi;
    if (is_jacobi) jacobi_.update(potential_);
    outcome =
        conjugate_gradients_.solve(potential_, constraints_, is_jacobi ? &jacobi_ : nullptr, right_side, options, step);
  }
  return {outcome.iterations, outcome.end};
}

}  // namespace hexsolver
