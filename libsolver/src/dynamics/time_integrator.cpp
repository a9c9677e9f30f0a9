// SPDX-License-Identifier: Apache-2.0
#include "dynamics/time_integrator.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dynamics/start_state.h"

namespace hexsolver {
namespace {

/// Substeps that a step may be divided into, a power of 2.
constexpr int most_substeps = 64;
/// Likewise with a fixed number of iterations, which is meant to bound the time of a step.
constexpr int most_substeps_of_fixed = 4;
/// By how much more than it had and was given the body may hold after a step, over the energies that change.
/// Where a body snaps through, implicit Euler gains a little at any size of the step: the smallest substeps, if solved
/// to the tolerance, may gain more.
constexpr double allowed_gain = 1e-9, allowed_gain_of_smallest = 1e-3;
/// A step of BDF2 errs either way, by the third power of its length, most where it begins: it may gain so much, and all
/// steps together so much more than they have lost.
constexpr double allowed_gain_of_bdf2 = 1e-2, allowed_gain_of_bdf2_in_all = 1e-3;
/// Of forces that are no gradient, whose energy is only a measure.
constexpr double allowed_gain_without_energy = 1e-6;
/// With a fixed number of Newton iterations so many more may follow where energy was gained: obstacles met in a step
/// are not known at its beginning.
constexpr int more_newton_iterations = 3;
constexpr int most_newton_iterations = 25;
/// Of the linear equations of one step, all its parts together, where they are solved to the tolerance. Steps take some
/// hundred; what takes so many more has stiffnesses that the solver cannot bear.
constexpr std::int64_t most_cycles = 20'000, most_plain_iterations = 50'000;

constexpr const char* through_itself = "a part of the body would go through another";

/// In the words of a motion.
const char* reason_of_substep(NewtonEnd end) {
  switch (end) {
    case NewtonEnd::not_positive:
      return "the linear equations have no solution";
    case NewtonEnd::no_descent:
      return "no step lowers the energy";
    case NewtonEnd::too_many_linear_iterations:
      return "the linear equations take too many iterations (stiffnesses too far apart, or another [dynamics] solver?)";
    case NewtonEnd::supports_turn_inside_out:
      return "points of the body would turn inside out";
    default:
      return "too many Newton iterations";
  }
}

Energies energies_of(const LevelProblem& problem, const Inertia& inertia, const NodeVector& u, const NodeVector& v) {
  return {inertia.kinetic_energy(v), problem.strain_energy(u), problem.contact_energy(u), problem.load_energy(u)};
}

double sum_of_sizes(const Energies& e) { return e.kinetic + e.strain + e.contact + std::abs(e.loads); }

}  // namespace

TimeIntegrator::TimeIntegrator(const hexmesh::Lattice& lattice, const Scene& scene, int level)
    : lattice_(lattice),
      scene_(scene),
      settings_(*scene.dynamics),
      problem_(lattice, scene, level),
      corners_(scene, settings_.step / most_substeps) {
  const std::size_t cells = problem_.mesh().num_cells();
  on_level_ = OnLevel::of(problem_.cells(), problem_.mesh());
  problem_.build_potential(scene.elasticity, std::vector<bool>(scene.finds_strain ? cells : 0));
  inertia_ = &problem_.add_term(std::make_unique<Inertia>(problem_.mesh(), problem_.cells().elements(),
                                                          lumped_masses(problem_.cells()), scene.damping.mass_per_s));
  if (scene.damping.stiffness_s > 0)
    damping_ = &problem_.add_term(std::make_unique<StiffnessDamping>(problem_.elastic(), scene.damping.stiffness_s));
  const Mesh& mesh = problem_.mesh();
  rounding_of_places_ =
      10 * std::numeric_limits<double>::epsilon() * (mesh.position(0) - mesh.position(mesh.num_nodes() - 1)).norm();
  rotations_.emplace(problem_.elastic(), scene.finds_strain);
  equations_.emplace(problem_, settings_);
  newton_.emplace(*equations_, newton_options());
  accept_ = [this](const NodeVector& /*end*/, const NodeVector& projected) { return accept(projected); };
  start();
}

NewtonOptions TimeIntegrator::newton_options() const {
  NewtonOptions options;
  options.tolerance = scene_.tolerance;
  options.fixed_iterations = settings_.newton_iterations;
  options.max_iterations =
      is_to_tolerance() ? most_newton_iterations : settings_.newton_iterations + more_newton_iterations;
  options.checks_start = false;
  options.solves_linear_in_one_step = false;
  options.projection = HessianProjection::Start::exact;
  options.line_search.shortest = options.line_search.shortest_without_energy = 1.0 / 16;
  options.line_search.takes_half_residual = true;
  return options;
}

void TimeIntegrator::start() {
  const auto dofs = static_cast<Eigen::Index>(problem_.mesh().num_dofs());
  u_.setZero(dofs);
  v_.resize(dofs);
  for (Eigen::Index n = 0; n < dofs; n += 3) v_.segment<3>(n) = settings_.velocity;
  if (!settings_.start.empty()) {
    const StartState before = read_start_state(settings_.start, problem_, on_level());
    u_ = before.displacement;
    if (before.velocity.size() > 0) v_ += before.velocity;
  }
  set_state(u_, v_);
}

void TimeIntegrator::set_state(const NodeVector& u, const NodeVector& v) {
  u_ = u;
  v_ = v;
  problem_.set_progress(progress());
  rotations_->let_go();
  if (rotations_->have_to_begin(u_)) rotations_->begin(time());
  difference_.forget();
  lost_ = 0;
  difference_.begin_euler(settings_.step);
  begin_terms();
  problem_.forget_frictions(u_);
  energies_ = energies_of(problem_, *inertia_, u_, v_);
  support_force_.setZero(u.size());
}

bool TimeIntegrator::grab(std::size_t point, const Vec3& place, double reach) {
  Grabs* grabs = problem_.grabs();
  if (!grabs || !grabs->holds(point)) {
    if (!problem_.grasp(point, lattice_.surface, reach, u_)) return false;
    grabs = problem_.grabs();
    equations_->forget_preconditioner();
  }
  grabs->pull(point, place - (lattice_.surface.points[point] + grabs->displacement(point)));
  return true;
}

/// What the hand has stretched goes with it.
void TimeIntegrator::let_go(std::optional<std::size_t> point) {
  Grabs* grabs = problem_.grabs();
  if (!grabs || !grabs->holds_any() || (point && !grabs->holds(*point))) return;
  if (point)
    grabs->let_go(*point);
  else
    grabs->let_go();
  equations_->forget_preconditioner();
  const double stored = std::exchange(energies_.contact, problem_.contact_energy(u_));
  work_ += energies_.contact - stored;
}

/// Where hands ask what cannot be solved they let go.
bool TimeIntegrator::lets_go() {
  Grabs* grabs = problem_.grabs();
  if (!grabs || !grabs->holds_any()) return false;
  let_go({});
  ++counts_.let_go;
  return true;
}

bool TimeIntegrator::step() {
  ++counts_.steps;
  const auto most = settings_.solver == StepSolver::multigrid ? most_cycles : most_plain_iterations;
  most_linear_ = counts_.linear + most;
  if (Grabs* grabs = problem_.grabs()) grabs->begin_step(time(), time() + settings_.step);
  int done = 0, substep = most_substeps;
  while (done < most_substeps) {
    if (!take_substep(settings_.step * substep / most_substeps)) {
      if (end_.allFinite() && hold_rotations(&end_)) continue;
      if (substep == smallest_substep() || counts_.linear > most_linear_) {
        if (!lets_go()) return false;
        most_linear_ = counts_.linear + most;
        continue;
      }
      substep /= 2;
      continue;
    }
    if (rotations_->num_held() > 0) hold_rotations(nullptr);  // as the state that was reached asks
    done += substep;
    ticks_ += substep;
    while (substep < most_substeps && done % (2 * substep) == 0 && done + 2 * substep <= most_substeps) substep *= 2;
  }
  return true;
}

double TimeIntegrator::time() const { return settings_.step * static_cast<double>(ticks_) / most_substeps; }

Progress TimeIntegrator::progress(double ahead) const {
  const double at = time() + ahead;
  return {std::min(1.0, at / settings_.duration), at};
}

int TimeIntegrator::smallest_substep() const { return is_to_tolerance() ? 1 : most_substeps / most_substeps_of_fixed; }

bool TimeIntegrator::is_smallest(double h) const {
  return h <= 1.5 * settings_.step / most_substeps * smallest_substep();
}

bool TimeIntegrator::fail(const char* why) {
  reason_ = why;
  return false;
}

void TimeIntegrator::be_at_rest_if_failed() {
  if (*reason_ == 0) return;
  problem_.set_progress(progress());
  inertia_->set_step(u_ - settings_.step * v_, v_, settings_.step);
}

/// What a step could not be solved for, or the state that was reached, says which cells keep their rotations.
/// @returns whether more do than before
bool TimeIntegrator::hold_rotations(const NodeVector* tried) {
  const std::size_t before = rotations_->num_held();
  const bool are_more = rotations_->hold(u_, tried);
  if (rotations_->num_held() == 0 && before == 0) return false;
  counts_.held = std::max(counts_.held, rotations_->num_held());
  energies_.strain = problem_.strain_energy(u_);
  equations_->forget_preconditioner();
  return are_more;
}

/// The forces and the energy of cells that begin to rotate are others, if by little before they have to. What they gain
/// is taken from the motion.
void TimeIntegrator::begin_to_rotate() {
  rotations_->begin(time());
  equations_->forget_preconditioner();
  const double before = std::exchange(energies_.strain, problem_.strain_energy(u_));
  const double gain = energies_.strain - before;
  if (!(gain > 0)) return;
  difference_.forget();
  v_ *= std::sqrt(std::max(0.0, 1 - gain / std::max(energies_.kinetic, gain)));
  energies_.kinetic = inertia_->kinetic_energy(v_);
}

/// The work of the forces in the directions held, on the way from u_ to end_: of those at its end, with BDF2 of the
/// mean of both ends. And by how much it may be larger since they change on the way.
TimeIntegrator::Work TimeIntegrator::work_of_supports(const NodeVector& projected) const {
  const NodeVector& gradient = equations_->last_gradient();
  Work work;
  for (Eigen::Index n = 0; n < end_.size(); ++n) {
    const double moved = end_[n] - u_[n], force = gradient[n] - projected[n];
    work.done += (!difference_.is_euler() ? (force + support_force_[n]) / 2 : force) * moved;
    work.uncertain += std::abs((force - support_force_[n]) * moved) / 2;
  }
  return work;
}

/// What acts over the step that begins.
void TimeIntegrator::begin_terms() {
  inertia_->set_step(difference_.u(u_), difference_.v(v_), difference_.length());
  if (damping_) damping_->set_step(difference_.u(u_), difference_.length(), difference_.ahead(u_));
}

/// A substep of h seconds; by implicit Euler where another form fails or the body would gain energy. On success the
/// state is that at its end.
bool TimeIntegrator::take_substep(double h) {
  if (corners_.lie_between(time() - difference_.length_before(), time() + h)) difference_.forget();
  if (settings_.integrator == Integrator::bdf2) {
    if (try_substep(h, difference_.has_past() ? Form::bdf2 : Form::start_of_bdf2)) return true;
    ++counts_.failed;
    difference_.forget();
    if (counts_.linear > most_linear_) return false;
  }
  if (try_substep(h, Form::euler)) return true;
  ++counts_.failed;
  return false;
}

/// end_ becomes the end of the step whose terms have begun, from where it is.
NewtonEnd TimeIntegrator::solve_step(const Newton<NodeVector>::Accept& accept) {
  inertia_->inertial_predictor(scene_.gravity, end_, predictor_);
  equations_->begin(difference_.length(), predictor_);
  if (is_to_tolerance())
    newton_->options().most_linear_iterations_in_all = std::max<std::int64_t>(1, most_linear_ - counts_.linear);
  const NewtonEnd end = newton_->run(end_, {}, accept);
  counts_.newton += newton_->iterations();
  counts_.linear += newton_->linear_iterations();
  counts_.preconditioners = equations_->times_made();
  return end;
}

/// What friction may come to at the end of the step, and which places of segments touch, from solutions with what was
/// so before; once only where the number of iterations is fixed.
NewtonEnd TimeIntegrator::attach_contacts() {
  constexpr int most_rounds = 5;
  constexpr double little = 1e-2;
  if (!problem_.has_attached_contacts()) return NewtonEnd::converged;
  problem_.attach_contacts(u_);
  for (int round = 0; is_to_tolerance() && round < most_rounds; ++round) {
    if (const NewtonEnd end = solve_step({}); end != NewtonEnd::converged) return end;
    if (problem_.passes_through_itself(end_)) {
      reason_ = through_itself;
      return NewtonEnd::not_accepted;
    }
    if (problem_.attach_contacts(end_) <= little) break;
  }
  return NewtonEnd::converged;
}

bool TimeIntegrator::fail(NewtonEnd end) { return fail(*reason_ == 0 ? reason_of_substep(end) : reason_); }

bool TimeIntegrator::try_substep(double h, Form form) {
  const Progress now = progress(), then = progress(h);
  end_ = u_;
  for (const PenaltyContact* c : problem_.contacts())
    if (!is_smallest(h) && c->goes_too_far(now, then)) return fail("an obstacle would go through the surface");
  reason_ = "";
  if (form == Form::start_of_bdf2) {
    const double part = BackwardDifference::first_stage(h);
    problem_.set_progress(progress(part));
    difference_.begin_euler(part);
    begin_terms();
    problem_.attach_contacts(u_);
    if (const NewtonEnd end = solve_step({}); end != NewtonEnd::converged) return fail(end);
    velocity_ = (end_ - u_) / part;
    difference_.begin_second_stage(u_, v_, end_, velocity_, h);
  } else if (form == Form::bdf2) {
    difference_.begin_bdf2(u_, v_, h);
  } else {
    difference_.begin_euler(h);
  }
  if (!problem_.contacts().empty() || problem_.grabs() || problem_.constraints().are_soft())
    problem_.set_progress(now);  // a substep that failed left them ahead
  obstacle_work_ = problem_.work_of_obstacles(u_, now, then);
  problem_.set_progress(then);
  begin_terms();
  h_ = h;
  if (const NewtonEnd end = attach_contacts(); end != NewtonEnd::converged) return fail(end);
  before_ = energies_;
  before_.contact = problem_.contact_potential(u_);
  before_.loads = problem_.load_energy(u_);

  const NewtonEnd end = solve_step(accept_);
  if (end == NewtonEnd::converged) {
    counts_.relative_residual = newton_->relative_residual();
    counts_.largest_residual = std::max(counts_.largest_residual, counts_.relative_residual);
    return true;
  }
  if (end_.allFinite() && rotations_->have_to_begin(end_)) {
    begin_to_rotate();
    return take_substep(h);
  }
  if (form == Form::euler && !is_to_tolerance() && is_smallest(h)) return slow_down();
  return fail(end);
}

/// Take end_ for the state at the end of the substep, unless it holds more energy than it had and was given.
bool TimeIntegrator::accept(const NodeVector& projected) {
  if (rotations_->have_to_begin(end_)) return fail("cells have to rotate");
  if (!end_.allFinite()) return fail("points of the body would turn inside out");
  if (problem_.passes_through_itself(end_)) return fail(through_itself);
  velocity_ = (end_ - difference_.u(u_)) / difference_.length();
  const Energies now = energies_of(problem_, *inertia_, end_, velocity_);
  if (!std::isfinite(now.total())) return fail("points of the body would turn inside out");
  const Work work = work_of_supports(projected);
  const double gain = now.total() - before_.total() - work.done;
  largest_energy_ = std::max({largest_energy_, sum_of_sizes(before_), sum_of_sizes(now)});
  const double rounding = 1e-14 * largest_energy_ + problem_.potential().rounding() * rounding_of_places_;
  const double scale = sum_of_sizes(before_) + sum_of_sizes(now) + std::abs(work.done);
  const double allowed = is_to_tolerance() && is_smallest(h_)     ? allowed_gain_of_smallest
                         : problem_.potential().is_conservative() ? allowed_gain
                                                                  : allowed_gain_without_energy;
  const double given_back = difference_.is_euler() ? 0
                                                   : std::clamp(lost_ + allowed_gain_of_bdf2_in_all * largest_energy_,
                                                                0.0, allowed_gain_of_bdf2 * scale);
  const double unexplained = gain - work.uncertain - rounding - given_back;
  if (!(unexplained <= allowed * scale)) return fail("the body would gain energy");
  if (unexplained > 0) counts_.largest_gain = std::max(counts_.largest_gain, unexplained / scale);
  ++counts_.substeps;
  const double of_obstacles = problem_.work_of_obstacles(end_, progress(), progress(h_));
  work_ += work.done + before_.loads - energies_.loads +
           (difference_.is_euler() ? of_obstacles : (of_obstacles + obstacle_work_) / 2);
  work_uncertainty_ += work.uncertain + std::abs(of_obstacles - obstacle_work_) / 2;
  friction_work_ += problem_.keep_contacts(end_);
  support_force_ = equations_->last_gradient() - projected;
  lost_ -= gain;
  if (settings_.integrator == Integrator::bdf2) difference_.remember(u_, v_, h_);
  u_.swap(end_);
  v_.swap(velocity_);
  energies_ = now;
  reason_ = "";
  return true;
}

/// What too few iterations made of the smallest substep holds too much energy: go only some of the way. A body that
/// does not move but for its supports holds no more than it had, so some part of the way is always possible.
bool TimeIntegrator::slow_down() {
  problem_.constraints().lift(u_, support_step_);
  predictor_ = end_ - u_ - support_step_;
  if (!predictor_.allFinite()) predictor_.setZero();
  for (double way = 0.5; true; way = way > 1.0 / most_substeps ? way / 2 : 0) {
    end_ = u_ + support_step_ + way * predictor_;
    equations_->gradient(end_, projected_);
    equations_->project(projected_);
    if (accept(projected_)) {
      ++counts_.slowed;
      return true;
    }
    if (way == 0) return false;
  }
}

}  // namespace hexsolver
