// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "core/stopwatch.h"
#include "hexsolver/report/report.h"
#include "newton/hessian_projection.h"
#include "newton/line_search.h"
#include "newton/newton_problem.h"

namespace hexsolver {

struct NewtonOptions {
  /// The run ends too once what one more step would add is at most so small a part of the way from the start, both in
  /// the problem's measure of fields, and supports carry the loads; 0: the tolerance alone.
  double part_of_way = 0;
  double tolerance = 1e-8;          ///< on the relative residual |P g| / |sum of absolute cell forces and loads|
  int max_iterations = 25;          ///< what converges takes 4 to 12; four times as many where a body buckles
  int max_linear_iterations = 500;  ///< per Newton step
  bool estimate_error = true;       ///< fill NewtonOutcome::algebraic_error, for one V-cycle
  std::function<bool()> interrupt;  ///< asked before every linear iteration; true ends it

  /// So many iterations in place of the tolerance, with whole steps; 0 = until the tolerance holds. Further ones, up to
  /// max_iterations, follow while the state is not accepted.
  int fixed_iterations = 0;
  bool checks_start = true;  ///< refuse a start of infinite energy
  /// Take a step from a start whose residual counts as nothing for the size of rounding errors alone: the forces of a
  /// scene may be as small.
  bool moves_from_rounding = false;
  /// Of all Newton steps together; 0 = as many as it takes.
  std::int64_t most_linear_iterations_in_all = 0;
  bool solves_linear_in_one_step = true;  ///< of a linear problem, as sharply as the tolerance asks
  HessianProjection::Start projection = HessianProjection::Start::projected;
  LineSearch line_search;
};

/// Why Newton's method ended.
enum class NewtonEnd {
  converged,
  accurate,  ///< converged, in part_of_way
  interrupted,
  start_is_inside_out,
  too_many_iterations,
  not_positive,              ///< nor is the projected Hessian, or what is held does not suffice
  supports_turn_inside_out,  ///< no part of the way to their places is possible
  no_descent,
  too_many_linear_iterations,
  not_finite,
  not_accepted
};

/// Whether the solution is there.
constexpr bool is_good(NewtonEnd end) { return end == NewtonEnd::converged || end == NewtonEnd::accurate; }

/// In words, for reports.
const char* reason_of(NewtonEnd end, bool is_conservative);

/// What is called after every Newton step: iteration, relative residual, linear iterations of the step.
using NewtonProgress = std::function<void(int, double, int)>;

/// Minimises the energy of a problem under H u = c by Newton's method.
///
/// Each step solves the linearised problem in the subspace that leaves the supports alone, as sharply as it pays. A
/// step along which the Hessian is not positive falls back to the projected one. A line search keeps the energy falling
/// once the supports hold (of forces that are no gradient: the residual, or its part along the step). Space for fields
/// is kept between runs.
template <class Vector>
class Newton {
public:
  using Accept = std::function<bool(const Vector& u, const Vector& projected_gradient)>;

  /// @param problem  must outlive this
  explicit Newton(NewtonProblem<Vector>& problem, NewtonOptions options = {})
      : problem_(problem), options_(std::move(options)) {}

  NewtonOptions& options() noexcept { return options_; }

  /// @param u       where to start from; receives the state reached, the last one of falling energy
  /// @param accept  asked once the tolerance holds or the fixed iterations are done; empty: always
  NewtonEnd run(Vector& u, const NewtonProgress& progress = {}, const Accept& accept = {});

  // Of the last run:
  int iterations() const noexcept { return iterations_; }
  int linear_iterations() const noexcept { return linear_iterations_; }
  double relative_residual() const noexcept { return relative_; }
  double force_seconds() const noexcept { return force_seconds_; }  ///< for gradients and energies
  const Vector& projected_gradient() const noexcept { return gradient_; }
  /// What one more step would add, of a run that ended accurate.
  const Vector& error() const noexcept { return step_; }
  double projection() const noexcept { return projection_.now(); }  ///< of the Hessian, for a next step

private:
  bool is_to_tolerance() const { return options_.fixed_iterations == 0; }
  bool may_end(bool supports_hold) const {
    return is_to_tolerance() ? supports_hold && relative_ <= options_.tolerance
                             : iterations_ >= options_.fixed_iterations;
  }
  bool is_accurate(const Vector& u, bool supports_hold);
  bool solves_in_one_step() const { return options_.solves_linear_in_one_step && options_.part_of_way == 0; }
  double residual(const Vector& u, Vector& projected, bool forgives_rounding = true);
  void start_from_rounding(const Vector& u);
  double energy(const Vector& u);
  LinearOutcome find_step(const Vector& u, bool supports_hold);
  LinearGoal<Vector> goal(const Vector& u, bool supports_hold);
  bool move_whole(Vector& u);
  std::optional<double> search_line(Vector& u, bool may_extend);
  double extend(Vector& u, double energy_here, double slope_before);

  static constexpr double unbalanced_to_part_ = 1e-4;
  static constexpr double near_ = 3e-2;  ///< residual, below which steps turn cells by little

  NewtonProblem<Vector>& problem_;
  NewtonOptions options_;
  Vector gradient_ = problem_.make_field(), next_gradient_ = problem_.make_field();  ///< projected
  Vector step_ = problem_.make_field(), support_step_ = problem_.make_field(), trial_ = problem_.make_field(),
         right_side_ = problem_.make_field();
  HessianProjection projection_;
  bool is_start_rounding_ = false;  ///< and a step is to be taken from it all the same
  double relative_ = 0, force_seconds_ = 0;
  int iterations_ = 0, linear_iterations_ = 0;
  bool buckles_ = false;                  ///< a step was extended
  Vector start_ = problem_.make_field();  ///< of the run, for part_of_way
};

/// |P g| over the sum of absolute cell forces and loads; forces of the size of rounding errors count as balanced.
template <class Vector>
double Newton<Vector>::residual(const Vector& u, Vector& projected, bool forgives_rounding) {
  const Stopwatch watch;
  const double magnitude = problem_.gradient(u, projected);
  problem_.project(projected);
  const double balanced = magnitude + (forgives_rounding ? problem_.rounding(u) / options_.tolerance : 0);
  const double relative = balanced == 0 ? 0 : norm(projected) / balanced;
  force_seconds_ += watch.seconds();
  return relative;
}

/// Where stiff bodies bear small forces the estimate of rounding, which is one for all states, may be above them.
template <class Vector>
void Newton<Vector>::start_from_rounding(const Vector& u) {
  is_start_rounding_ = false;
  if (!options_.moves_from_rounding || !is_to_tolerance() || relative_ > options_.tolerance) return;
  const double strict = residual(u, gradient_, false);
  is_start_rounding_ = strict > options_.tolerance;
  if (is_start_rounding_) relative_ = strict;
}

template <class Vector>
double Newton<Vector>::energy(const Vector& u) {
  const Stopwatch watch;
  const double energy = problem_.energy(u);
  force_seconds_ += watch.seconds();
  return energy;
}

/// A linear problem is solved at once, as sharply as the tolerance asks.
template <class Vector>
LinearGoal<Vector> Newton<Vector>::goal(const Vector& u, bool supports_hold) {
  LinearGoal<Vector> goal;
  goal.is_near = supports_hold && relative_ < near_;
  goal.is_first = iterations_ == 1;
  if (!is_to_tolerance()) {
    goal.relative_tolerance = 0.1 * options_.tolerance;
  } else if (problem_.is_linear() && solves_in_one_step()) {
    goal.relative_tolerance = 0.1;
    goal.excess = [this, &u, supports_hold](const Vector& step) {
      set_sum(trial_, u, 1, step);
      if (!supports_hold) set_sum(trial_, trial_, 1, support_step_);
      return residual(trial_, next_gradient_) / options_.tolerance;
    };
  } else if (is_start_rounding_ && goal.is_first) {
    goal.relative_tolerance = options_.tolerance;  // there may be no other step
  } else {
    goal.relative_tolerance = forcing(options_.tolerance, relative_, supports_hold || options_.part_of_way > 0);
  }
  return goal;
}

/// step_ = the Newton step beyond the one that brings the supports to their places; where the exact Hessian is not
/// positive, that of the projected one.
template <class Vector>
LinearOutcome Newton<Vector>::find_step(const Vector& u, bool supports_hold) {
  const LinearGoal<Vector> goal = this->goal(u, supports_hold);
  int iterations = 0;
  while (true) {
    problem_.linearize(u, projection_.now(), goal.is_near);
    if (supports_hold) {
      set_to(right_side_, gradient_);
    } else {
      problem_.apply(support_step_, right_side_);
      set_sum(right_side_, gradient_, 1, right_side_);
    }
    negate(right_side_);
    const LinearOutcome outcome = problem_.solve(right_side_, goal, step_);
    iterations += outcome.iterations;
    // The best so far leads down; to a tolerance it is not enough.
    const bool suffices = outcome.end != LinearEnd::negative_curvature || projection_.is_full() ||
                          (!is_to_tolerance() && largest(step_) > 0);
    if (suffices) return {iterations, outcome.end};
    projection_.add();
  }
}

/// u += step_, or a part of it where the law has no meaning at its end; false if no part is possible.
template <class Vector>
bool Newton<Vector>::move_whole(Vector& u) {
  constexpr double shortest = 1.0 / 64;
  const bool can_fail = is_to_tolerance() && !problem_.is_linear();
  const auto part = LineSearch::backtrack(shortest, [&](double length) {
    set_sum(trial_, u, length, step_);
    return !can_fail || std::isfinite(energy(trial_));
  });
  if (!part) return false;
  swap_fields(u, trial_);
  relative_ = residual(u, gradient_);
  return true;
}

/// @returns the part of step_ taken, more than 1 where it was extended; nothing if no part helps
template <class Vector>
std::optional<double> Newton<Vector>::search_line(Vector& u, bool may_extend) {
  const LineSearch& search = options_.line_search;
  const bool has_energy = problem_.is_conservative();
  const double before = energy(u), slope = dot(gradient_, step_);
  const double size = has_energy ? 0 : problem_.measure(gradient_);
  const double rounding = LineSearch::energy_rounding(before, problem_.rounding(), largest(step_));
  const double noise = rounding + problem_.energy_rounding();
  double after = 0;
  const auto try_part = [&](double length) {
    set_sum(trial_, u, length, step_);
    const double decrease = LineSearch::least_decrease * length;
    after = has_energy ? energy(trial_) : 0;
    const bool falls = !has_energy || after <= before + decrease * slope + rounding;
    const bool may_fall = falls || after <= before + noise;
    const bool may_halve = search.takes_half_residual && length == 1;
    if (!may_fall && !may_halve) return false;
    const double relative = residual(trial_, next_gradient_);
    const bool settles = may_fall && LineSearch::is_settled(slope, dot(next_gradient_, step_));
    if (!falls && !settles && !(may_halve && relative < 0.5 * relative_)) return false;
    if (!has_energy && !(problem_.measure(next_gradient_) < (1 - decrease) * size) &&
        !LineSearch::is_shorter(slope, dot(next_gradient_, step_)))
      return false;
    swap_fields(u, trial_);
    swap_fields(gradient_, next_gradient_);
    relative_ = relative;
    return true;
  };
  const auto part = LineSearch::backtrack(has_energy ? search.shortest : search.shortest_without_energy, try_part);
  return part == 1.0 && may_extend && has_energy && !problem_.is_linear() ? extend(u, after, slope) : part;
}

/// Double a step while the energy along it falls about as steeply as at its start. Where a body buckles the projected
/// Hessian, stiffer than the body, makes steps short.
/// @param u             at the end of step_
/// @param slope_before  along step_ at its start
/// @returns the length of the step in that of step_
template <class Vector>
double Newton<Vector>::extend(Vector& u, double energy_here, double slope_before) {
  double length = 1;
  for (double slope = dot(gradient_, step_); LineSearch::goes_on(slope_before, slope);
       slope = dot(gradient_, step_), length *= 2) {
    set_to(right_side_, step_);
    set_sum(right_side_, right_side_, length - 1, step_);
    if (problem_.longest_step(u, right_side_) < 1) break;
    set_sum(trial_, u, 1, right_side_);
    const double after = energy(trial_);
    if (!(after <= energy_here + LineSearch::least_decrease * length * slope)) break;
    energy_here = after;
    swap_fields(u, trial_);
    relative_ = residual(u, gradient_);
  }
  return length;
}

/// Asked where it may be true only: it takes a linearization and one application of the preconditioner.
template <class Vector>
bool Newton<Vector>::is_accurate(const Vector& u, bool supports_hold) {
  if (options_.part_of_way == 0 || !supports_hold || iterations_ == 0 || !(relative_ < near_)) return false;
  if (problem_.unbalanced(gradient_) > unbalanced_to_part_) return false;
  if (!problem_.precondition(u, projection_.now(), gradient_, step_)) return false;
  set_sum(trial_, u, -1, start_);
  return problem_.size(step_) <= options_.part_of_way * problem_.size(trial_);
}

template <class Vector>
NewtonEnd Newton<Vector>::run(Vector& u, const NewtonProgress& progress, const Accept& accept) {
  projection_ = HessianProjection(options_.projection);
  iterations_ = linear_iterations_ = 0;
  buckles_ = false;
  force_seconds_ = 0;
  if (options_.checks_start && !problem_.is_linear() && !std::isfinite(energy(u)))
    return NewtonEnd::start_is_inside_out;
  relative_ = residual(u, gradient_);
  start_from_rounding(u);
  if (options_.part_of_way > 0) set_to(start_, u);
  while (true) {
    const bool supports_hold = problem_.lift(u, support_step_);
    if (may_end(supports_hold)) {
      if (!accept || accept(u, gradient_)) return NewtonEnd::converged;
      if (is_to_tolerance()) return NewtonEnd::not_accepted;
    }
    if (is_accurate(u, supports_hold)) return NewtonEnd::accurate;
    if (!std::isfinite(relative_)) return NewtonEnd::not_finite;
    if (iterations_ >= (buckles_ ? 4 : 1) * options_.max_iterations) return NewtonEnd::too_many_iterations;
    ++iterations_;

    const LinearOutcome linear = find_step(u, supports_hold);
    linear_iterations_ += linear.iterations;
    if (linear.end == LinearEnd::interrupted) return NewtonEnd::interrupted;
    if (options_.most_linear_iterations_in_all > 0 && linear_iterations_ > options_.most_linear_iterations_in_all)
      return NewtonEnd::too_many_linear_iterations;
    if (linear.end == LinearEnd::negative_curvature && largest(step_) == 0) return NewtonEnd::not_positive;

    if (!supports_hold || !is_to_tolerance()) {
      if (!supports_hold) set_sum(step_, support_step_, 1, step_);
      if (!move_whole(u)) return NewtonEnd::supports_turn_inside_out;
    } else {
      const double most = problem_.longest_step(u, step_);
      if (most < 1) set_sum(step_, step_, most - 1, step_);
      const std::optional<double> length = search_line(u, most >= 1);
      if (!length) return is_start_rounding_ && iterations_ == 1 ? NewtonEnd::converged : NewtonEnd::no_descent;
      buckles_ = buckles_ || *length > 1;
      projection_.adapt(*length >= 1, relative_);
    }
    if (progress) progress(iterations_, relative_, linear.iterations);
  }
}

}  // namespace hexsolver
