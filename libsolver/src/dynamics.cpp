// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/dynamics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "conclude.h"
#include "hexmesh/core/error.h"
#include "hexsolver/conjugate_gradients.h"
#include "hexsolver/inertia.h"
#include "hexsolver/viscosity.h"
#include "level_problem.h"
#include "stopwatch.h"

namespace hexsolver {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Lattice;
using hexmesh::Result;

/// Parts of a step that may be solved apart, a power of 2.
constexpr int most_parts = 64;
/// Likewise with a fixed number of iterations, which is meant to bound the time of a step.
constexpr int most_parts_of_fixed = 4;
/// By how much more than it had and was given the body may hold after a step, over the energies that change.
/// Where a body snaps through, implicit Euler gains a little at any size of the step: the smallest parts, if solved to
/// the tolerance, may gain more.
constexpr double allowed_gain = 1e-9, allowed_gain_of_smallest = 1e-3;
/// Of forces that are no gradient, whose energy is only a measure.
constexpr double allowed_gain_without_energy = 1e-6;
/// With a fixed number of Newton iterations so many more may follow where energy was gained: obstacles met in a step
/// are not known at its beginning.
constexpr int more_newton_iterations = 3;
constexpr int most_newton_iterations = 25;
/// With solve.strain = "auto" cells turn from the angle that leaves 1e-3 of strain, and no longer below half of it.
constexpr double turning_angle = 0.045;

Energies energies_of(const LevelProblem& problem, const Inertia& inertia, const NodeVector& u, const NodeVector& v) {
  return {inertia.kinetic_energy(v), problem.elastic().energy(u), problem.contact_energy(u), problem.load_energy(u)};
}

double sum_of_sizes(const Energies& e) { return e.kinetic + e.strain + e.contact + std::abs(e.loads); }

NodeVector to_nodes(const std::vector<Vec3>& points) {
  NodeVector out(3 * static_cast<Eigen::Index>(points.size()));
  for (std::size_t n = 0; n < points.size(); ++n) out.segment<3>(3 * static_cast<Eigen::Index>(n)) = points[n];
  return out;
}

/// Keeps a preconditioner until the iterations lost to its age are worth making a new one.
class LaggingMultigrid {
public:
  LaggingMultigrid(const LevelProblem& problem) : problem_(problem) {}

  /// More than these are a reason to make a new one.
  static constexpr int most_iterations = 40;

  /// @param h  of the step; another one makes another matrix
  bool is_made_for(double h) const { return multigrid_ && h == made_for_; }

  /// Of the potential as it is linearized, or was; nullptr if that is not positive.
  const Multigrid* get(double h) {
    if (!is_made_for(h)) make(h);
    return multigrid_->is_positive() ? multigrid_.get() : nullptr;
  }

  void forget() { made_for_ = 0; }

  int times_made() const { return made_; }
  std::size_t bytes() const { return multigrid_ ? multigrid_->bytes() : 0; }

  /// What the last solution with it was like.
  void judge(const ConjugateGradients::Outcome& outcome) {
    if (outcome.iterations == 0) return;
    const double digits = -std::log10(std::max(outcome.reduction, 1e-300)) / outcome.iterations;
    if (digits_at_first_ == 0) digits_at_first_ = digits;
    lost_ += outcome.iterations * (1 - digits / digits_at_first_);
    if (lost_ > cost_) forget();
  }

private:
  static constexpr double cost_ = 8;  ///< of making one, in iterations

  void make(double h) {
    ++made_;
    if (multigrid_)
      multigrid_->update();
    else
      multigrid_ = std::make_unique<Multigrid>(problem_.hierarchy(), problem_.potential(), problem_.constraints());
    made_for_ = h;
    digits_at_first_ = lost_ = 0;
  }

  const LevelProblem& problem_;
  std::unique_ptr<Multigrid> multigrid_;
  double made_for_ = 0;         ///< h of the step; 0: of none
  double digits_at_first_ = 0;  ///< per iteration
  double lost_ = 0;             ///< iterations
  int made_ = 0;
};

}  // namespace

class Motion::Integrator {
public:
  Integrator(const Lattice& lattice, const Scene& scene, int level)
      : lattice_(lattice),
        scene_(scene),
        settings_(*scene.dynamics),
        problem_(lattice, scene, level),
        multigrid_(problem_),
        jacobi_(problem_.constraints()) {
    const std::size_t cells = problem_.mesh().num_cells();
    problem_.build_potential(scene.elasticity, std::vector<bool>(scene.finds_strain ? cells : 0));
    inertia_ = &problem_.add_term(std::make_unique<Inertia>(problem_.mesh(),
                                                            lattice.levels[static_cast<std::size_t>(level)].element,
                                                            lumped_masses(lattice, level), scene.damping.mass_per_s));
    if (scene.damping.stiffness_s > 0)
      viscosity_ = &problem_.add_term(std::make_unique<Viscosity>(problem_.elastic(), scene.damping.stiffness_s));
    const Mesh& mesh = problem_.mesh();
    rounding_of_places_ =
        10 * std::numeric_limits<double>::epsilon() * (mesh.position(0) - mesh.position(mesh.num_nodes() - 1)).norm();
    if (scene.finds_strain) turning_ = dynamic_cast<CorotationalCells*>(&problem_.elastic());
    start();
  }

  void start() {
    const auto dofs = static_cast<Eigen::Index>(problem_.mesh().num_dofs());
    u_.setZero(dofs);
    v_.resize(dofs);
    for (Eigen::Index n = 0; n < dofs; n += 3) v_.segment<3>(n) = settings_.velocity;
    if (!settings_.start.empty()) {
      const Result before = hexmesh::read_result(settings_.start);
      const auto is_same_place = [&](std::size_t n) {
        return (before.nodes[n] - problem_.mesh().position(n)).norm() < 1e-6 * before.voxels.spacing().norm();
      };
      if (before.cells != problem_.mesh().cells() || before.level != problem_.level() || !is_same_place(0) ||
          !is_same_place(before.nodes.size() - 1))
        throw Error(ErrorKind::input, fmt::format("dynamics.start is '{}', level {} of {} cells, expected a result of "
                                                  "this lattice at level {} of {} cells",
                                                  settings_.start.string(), before.level, before.cells.size(),
                                                  problem_.level(), problem_.mesh().num_cells()));
      u_ = to_nodes(before.displacement);
      if (!before.velocity.empty()) v_ += to_nodes(before.velocity);
    }
    set_state(u_, v_);
  }

  void set_state(const NodeVector& u, const NodeVector& v) {
    u_ = u;
    v_ = v;
    problem_.set_progress(progress());
    if (turning_) turning_->choose_turning(u_, turning_angle, turning_angle / 2);
    inertia_->set_step(u_, v_, settings_.step);
    if (viscosity_) viscosity_->set_step(u_, settings_.step);
    energies_ = energies_of(problem_, *inertia_, u_, v_);
    support_force_.setZero(u.size());
  }

  bool step() {
    ++counts.steps;
    int done = 0, part = most_parts;
    while (done < most_parts) {
      if (!try_part(settings_.step * part / most_parts)) {
        ++counts.failed;
        if (part == smallest_part()) return false;
        part /= 2;
        continue;
      }
      done += part;
      ticks_ += part;
      while (part < most_parts && done % (2 * part) == 0 && done + 2 * part <= most_parts) part *= 2;
    }
    return true;
  }

  /// After a part that failed the terms are in the midst of it: reactions are then those without acceleration.
  void be_at_rest_if_failed() {
    if (*reason == 0) return;
    problem_.set_progress(progress());
    inertia_->set_step(u_ - settings_.step * v_, v_, settings_.step);
  }

  /// Conditions may contradict each other at any time: at the corners of their tables and at the end. Obstacles and
  /// conditions at the start are held against the state that it is.
  void check(std::vector<std::string>& warnings) {
    constexpr std::size_t most_times = 100;
    constexpr double jump = 1;  // mm
    const auto add = [&](const std::vector<std::string>& more) {
      for (const std::string& w : more)
        if (std::find(warnings.begin(), warnings.end(), w) == warnings.end()) warnings.push_back(w);
    };
    std::set<double> times = {settings_.duration};
    for (const Condition& c : scene_.conditions)
      if (c.history)
        for (const History::Row& row : c.history->rows)
          if (row.time < settings_.duration && times.size() < most_times) times.insert(row.time);
    for (const double t : times) {
      problem_.set_progress({std::min(1.0, t / settings_.duration), t});
      add(check_conflicts(problem_.constraints(), problem_.level(), scene_));
    }
    problem_.set_progress(progress());
    add(check_contacts_at(problem_, u_));
    std::vector<double> miss(scene_.conditions.size());
    for (const ConstraintPoint& p : problem_.constraints().points()) {
      double& worst = miss[static_cast<std::size_t>(p.condition)];
      const Vec3 off = p.value - problem_.constraints().displacement(p, u_);
      for (int d = 0; d < 3; ++d)
        if (p.axes[static_cast<std::size_t>(d)]) worst = std::max(worst, std::abs(off[d]));
    }
    for (std::size_t c = 0; c < miss.size(); ++c)
      if (miss[c] > jump)
        add(
            {fmt::format("condition '{}' ({}) puts points {:.3g} mm from where the start has them: they jump there in "
                         "the first step",
                         scene_.conditions[c].name, scene_.conditions[c].where, miss[c])});
  }

  std::size_t num_turning() const {
    const std::vector<bool>& turning = turning_->turning();
    return static_cast<std::size_t>(std::count(turning.begin(), turning.end(), true));
  }

  /// A ball that has gone through the surface of the body.
  const PenaltyContact* ball_inside() const {
    for (const PenaltyContact* c : problem_.contacts())
      if (c->state(u_).is_inside) return c;
    return nullptr;
  }

  std::size_t preconditioner_bytes() const { return multigrid_.bytes(); }

  double time() const { return settings_.step * static_cast<double>(ticks_) / most_parts; }

  const Lattice& lattice_;
  const Scene scene_;
  const Dynamics settings_;
  LevelProblem problem_;
  Inertia* inertia_ = nullptr;      ///< in the potential
  Viscosity* viscosity_ = nullptr;  ///< likewise
  CorotationalCells* turning_ = nullptr;
  NodeVector u_, v_;
  Energies energies_;
  double work_ = 0, work_uncertainty_ = 0;
  Counts counts;
  const char* reason = "";  ///< why the last part was not accepted; empty if it was

private:
  Progress progress(double ahead = 0) const {
    const double at = time() + ahead;
    return {std::min(1.0, at / settings_.duration), at};
  }

  /// Cells begin to turn, and cease to unless that adds to the energy. What beginning adds is taken from the motion.
  void choose_turning() {
    if (!turning_) return;
    const double before = energies_.strain;
    turned_ = turning_->turning();
    turning_->choose_turning(u_, turning_angle, turning_angle / 2);
    energies_.strain = turning_->energy(u_);
    if (energies_.strain > before) {
      for (std::size_t c = 0; c < turned_.size(); ++c) turned_[c] = turned_[c] || turning_->turning()[c];
      turning_->set_turning(turned_);
      energies_.strain = turning_->energy(u_);
    }
    const double gain = energies_.strain - before;
    if (!(gain > 0)) return;
    v_ *= std::sqrt(std::max(0.0, 1 - gain / std::max(energies_.kinetic, gain)));
    energies_.kinetic = inertia_->kinetic_energy(v_);
  }

  bool fail(const char* why) {
    reason = why;
    return false;
  }

  /// A step of h seconds; on success the state is that at its end.
  bool try_part(double h);
  bool is_to_tolerance() const { return settings_.newton_iterations == 0; }
  int smallest_part() const { return is_to_tolerance() ? 1 : most_parts / most_parts_of_fixed; }
  bool is_smallest(double h) const { return h <= 1.5 * settings_.step / most_parts * smallest_part(); }
  bool accept(double h, const Energies& start);
  bool slow_down(double h, const Energies& start);
  bool newton_step(double h, bool is_first, double relative);
  ConjugateGradients::End solve_linear(double h, ConjugateGradients::Options options);
  bool search_line(double relative);
  double relative_residual();
  struct Work {
    double done = 0, uncertain = 0;
  };
  Work work_of_supports() const;

  LaggingMultigrid multigrid_;
  BlockJacobi jacobi_;
  ConjugateGradients conjugate_gradients_;
  std::int64_t ticks_ = 0;    ///< parts of steps done
  NodeVector support_force_;  ///< at u_
  std::vector<bool> turned_;
  double largest_energy_ = 0, rounding_of_places_ = 0;
  NodeVector end_, trial_, gradient_, projected_, magnitude_, support_step_, right_side_, first_, newton_step_,
      velocity_;
  bool supports_hold_ = false;
};

double Motion::Integrator::relative_residual() {
  Potential& potential = problem_.potential();
  potential.gradient(end_, gradient_, magnitude_);
  projected_ = gradient_;
  problem_.constraints().project(projected_);
  return projected_.norm() / (magnitude_.norm() + potential.rounding() / scene_.tolerance);
}

/// The work of the forces in the directions held, on the way from u_ to end_, and by how much it may be larger since
/// they change on the way; gradient_ and projected_ are those at the end.
Motion::Integrator::Work Motion::Integrator::work_of_supports() const {
  Work work;
  for (Eigen::Index n = 0; n < end_.size(); ++n) {
    const double moved = end_[n] - u_[n], force = gradient_[n] - projected_[n];
    work.done += force * moved;
    work.uncertain += std::abs((force - support_force_[n]) * moved) / 2;
  }
  return work;
}

bool Motion::Integrator::try_part(double h) {
  const Progress now = progress(), then = progress(h);
  for (const PenaltyContact* c : problem_.contacts())
    if (!is_smallest(h) && c->goes_too_far(now, then)) return fail("an obstacle would go through the surface");
  problem_.set_progress(then);
  inertia_->set_step(u_, v_, h);
  if (viscosity_) viscosity_->set_step(u_, h);
  Energies start = energies_;
  start.contact = problem_.contact_energy(u_);
  start.loads = problem_.load_energy(u_);

  reason = "";
  end_ = u_;
  const int least = is_to_tolerance() ? 0 : settings_.newton_iterations;
  const int most = is_to_tolerance() ? most_newton_iterations : least + more_newton_iterations;
  for (int iteration = 0; iteration <= most; ++iteration) {
    problem_.potential().linearize(end_, Hessian::exact);
    const double relative = relative_residual();
    problem_.constraints().lift(end_, support_step_);
    supports_hold_ = problem_.constraints().hold(support_step_, end_);
    const bool may_end = is_to_tolerance() ? supports_hold_ && relative <= scene_.tolerance : iteration >= least;
    if (may_end && accept(h, start)) {
      counts.relative_residual = relative;
      counts.largest_residual = std::max(counts.largest_residual, relative);
      return true;
    }
    if ((may_end && is_to_tolerance()) || !std::isfinite(relative)) break;
    if (iteration == most || !newton_step(h, iteration == 0, relative)) break;
  }
  if (!is_to_tolerance() && is_smallest(h)) return slow_down(h, start);
  if (*reason == 0) reason = "too many Newton iterations";
  return false;
}

/// Take end_ for the state at the end of the part, unless it holds more energy than it had and was given.
bool Motion::Integrator::accept(double h, const Energies& start) {
  velocity_ = (end_ - u_) / h;
  const Energies now = energies_of(problem_, *inertia_, end_, velocity_);
  if (!std::isfinite(now.total())) return fail("points of the body would turn inside out");
  const Work work = work_of_supports();
  const double gain = now.total() - start.total() - work.done;
  largest_energy_ = std::max({largest_energy_, sum_of_sizes(start), sum_of_sizes(now)});
  const double rounding = 1e-14 * largest_energy_ + problem_.potential().rounding() * rounding_of_places_;
  const double scale = sum_of_sizes(start) + sum_of_sizes(now) + std::abs(work.done);
  const double allowed = is_to_tolerance() && is_smallest(h)      ? allowed_gain_of_smallest
                         : problem_.potential().is_conservative() ? allowed_gain
                                                                  : allowed_gain_without_energy;
  if (!(gain <= allowed * scale + work.uncertain + rounding)) return fail("the body would gain energy");
  const double unexplained = gain - work.uncertain - rounding;
  if (unexplained > 0) counts.largest_gain = std::max(counts.largest_gain, unexplained / scale);
  ++counts.parts;
  work_ += work.done + start.total() - energies_.total();
  work_uncertainty_ += work.uncertain;
  support_force_ = gradient_ - projected_;
  u_.swap(end_);
  v_.swap(velocity_);
  energies_ = now;
  choose_turning();
  reason = "";
  return true;
}

/// What too few iterations made of the smallest part holds too much energy: go only some of the way. A body that does
/// not move but for its supports holds no more than it had, so some part of the way is always possible.
bool Motion::Integrator::slow_down(double h, const Energies& start) {
  problem_.constraints().lift(u_, support_step_);
  first_ = end_ - u_ - support_step_;
  if (!first_.allFinite()) first_.setZero();
  for (double way = 0.5; true; way = way > 1.0 / most_parts ? way / 2 : 0) {
    end_ = u_ + support_step_ + way * first_;
    relative_residual();
    if (accept(h, start)) {
      ++counts.slowed;
      return true;
    }
    if (way == 0) return false;
  }
}

bool Motion::Integrator::newton_step(double h, bool is_first, double relative) {
  Potential& potential = problem_.potential();
  ++counts.newton;
  ConjugateGradients::Options options;
  if (settings_.solver_iterations > 0) {
    options.most_iterations = settings_.solver_iterations;
    options.relative_tolerance = 1e-14;
  } else {
    options.most_iterations = settings_.solver == StepSolver::multigrid ? 200 : 5000;
    const double needed = 0.1 * scene_.tolerance / relative;
    options.relative_tolerance =
        supports_hold_ ? std::max(std::min(10 * relative, 0.05), needed) : std::max(1e-3, 0.1 * scene_.tolerance);
    if (!is_to_tolerance()) options.relative_tolerance = 0.1 * scene_.tolerance;
  }
  if (is_first) {
    inertia_->free_flight(scene_.gravity, first_);
    options.first_direction = &first_;
  }

  for (const double clamping : {Hessian::exact, Hessian::clamped}) {
    if (clamping != Hessian::exact) potential.linearize(end_, clamping);
    right_side_ = -gradient_;
    if (!supports_hold_) {
      potential.apply(support_step_, trial_);
      right_side_ -= trial_;
    }
    newton_step_.setZero(end_.size());
    const ConjugateGradients::End end = solve_linear(h, options);
    if (end == ConjugateGradients::End::solved) break;
    // The best so far leads down; to a tolerance it is not enough.
    if (!is_to_tolerance() && !newton_step_.isZero(0)) break;
  }
  if (!newton_step_.allFinite()) return fail("the linear equations have no solution");
  if (supports_hold_ && is_to_tolerance()) return search_line(relative);
  end_ += newton_step_;
  if (!supports_hold_) end_ += support_step_;
  return true;
}

/// newton_step_ = the solution for right_side_.
ConjugateGradients::End Motion::Integrator::solve_linear(double h, ConjugateGradients::Options options) {
  const auto solve = [&](const Preconditioner* preconditioner) {
    const ConjugateGradients::Outcome outcome = conjugate_gradients_.solve(
        problem_.potential(), problem_.constraints(), preconditioner, right_side_, options, newton_step_);
    counts.linear += outcome.iterations;
    return outcome;
  };
  if (settings_.solver == StepSolver::cg) return solve(nullptr).end;
  if (settings_.solver == StepSolver::jacobi) {
    jacobi_.update(problem_.potential());
    return solve(&jacobi_).end;
  }
  const int most_iterations = options.most_iterations;
  while (true) {
    const bool is_new = !multigrid_.is_made_for(h);
    options.most_iterations = is_new ? most_iterations : std::min(most_iterations, LaggingMultigrid::most_iterations);
    const Multigrid* multigrid = multigrid_.get(h);
    counts.preconditioners = multigrid_.times_made();
    ConjugateGradients::Outcome outcome{0, ConjugateGradients::End::negative_curvature};
    if (multigrid) outcome = solve(multigrid);
    const bool ran_out = outcome.iterations == options.most_iterations && options.most_iterations < most_iterations;
    if (outcome.end == ConjugateGradients::End::solved && !ran_out)
      multigrid_.judge(outcome);
    else
      multigrid_.forget();
    if (is_new || (outcome.end == ConjugateGradients::End::solved && !ran_out)) return outcome.end;
  }
}

/// Backtrack from end_ + newton_step_ until the energy of the step falls enough (Armijo); near the solution, where
/// energies differ by rounding only, until the residual does.
bool Motion::Integrator::search_line(double relative) {
  const Potential& potential = problem_.potential();
  const double energy = potential.energy(end_), slope = projected_.dot(newton_step_);
  const double rounding = 1e-13 * std::abs(energy) + potential.rounding() * newton_step_.lpNorm<Eigen::Infinity>();
  for (double length = 1; length >= 1.0 / 16; length /= 2) {
    trial_ = end_ + length * newton_step_;
    const bool falls =
        !potential.is_conservative() || potential.energy(trial_) <= energy + 1e-4 * length * slope + rounding;
    end_.swap(trial_);
    if (falls || (length == 1 && relative_residual() < 0.5 * relative)) return true;
    end_.swap(trial_);
  }
  return fail("no step lowers the energy");
}

Motion::Motion(const Lattice& lattice, const Scene& scene, int level)
    : integrator_(std::make_unique<Integrator>(lattice, scene, level)) {}
Motion::~Motion() = default;

bool Motion::step() { return integrator_->step(); }
const char* Motion::reason() const { return integrator_->reason; }
double Motion::time() const { return integrator_->time(); }
const NodeVector& Motion::displacement() const { return integrator_->u_; }
const NodeVector& Motion::velocity() const { return integrator_->v_; }
const Energies& Motion::energies() const { return integrator_->energies_; }
double Motion::work() const { return integrator_->work_; }
double Motion::work_uncertainty() const { return integrator_->work_uncertainty_; }
Vec3 Motion::momentum() const { return integrator_->inertia_->momentum(integrator_->v_); }
const Mesh& Motion::mesh() const { return integrator_->problem_.mesh(); }
const Index3& Motion::voxels_per_cell() const {
  return integrator_->lattice_.levels[static_cast<std::size_t>(integrator_->problem_.level())].voxels_per_cell;
}
void Motion::set_state(const NodeVector& u, const NodeVector& v) { integrator_->set_state(u, v); }
const Motion::Counts& Motion::counts() const { return integrator_->counts; }

const PenaltyContact* Motion::ball_inside() const { return integrator_->ball_inside(); }
void Motion::explain(std::vector<Effect>& effects) const {
  if (!integrator_->turning_) return;
  for (Effect& e : effects)
    if (e.name == "rotation")
      e.why += fmt::format("; at the end {} of {} cells turn", integrator_->num_turning(), mesh().num_cells());
}
void Motion::check(SolveReport& report) const { integrator_->check(report.warnings); }

Result Motion::conclude(SolveReport& report) const {
  if (report.levels.empty()) report.levels.emplace_back();
  integrator_->be_at_rest_if_failed();
  report.bytes = {{"lattice", hexmesh::bytes_of(integrator_->lattice_)},
                  {"meshes", integrator_->problem_.hierarchy().bytes()},
                  {"multigrid", integrator_->preconditioner_bytes()}};
  add_effect_seconds(integrator_->problem_, report);
  Result result = hexsolver::conclude(integrator_->lattice_, integrator_->problem_, integrator_->u_, report);
  result.velocity = to_points(integrator_->v_);
  return result;
}

namespace {

MotionReport::Row row_of(const Motion& motion) {
  return {motion.time(), motion.energies(), motion.work(), motion.work_uncertainty(), motion.momentum()};
}

}  // namespace

Result solve_dynamics(const Lattice& whole, const Scene& scene, int level, SolveReport& report,
                      const std::function<void(const Motion&)>& on_output,
                      const std::function<void(const Motion&)>& on_step) {
  report.warnings = check_single_points(scene);
  report.effects = list_effects(scene);
  report.elasticity = scene.elasticity;
  const Stopwatch setup;
  const std::optional<Lattice> rest = without_islands(whole, scene, level, report.dropped_cells);
  const Lattice& lattice = rest ? *rest : whole;
  if (rest) warn_of_dropped_cells(whole, level, report);
  Motion motion(lattice, scene, level);
  motion.check(report);
  report.setup_seconds = setup.seconds();

  MotionReport& of_motion = report.motion.emplace();
  const auto output = [&] {
    of_motion.rows.push_back(row_of(motion));
    if (on_output) on_output(motion);
  };
  const Dynamics& settings = *scene.dynamics;
  const int steps = settings.num_steps();
  const Stopwatch solve;
  output();
  report.converged = true;
  const PenaltyContact* ball = nullptr;
  for (int n = 1; n <= steps && report.converged; ++n) {
    report.converged = motion.step();
    if (report.converged && on_step) on_step(motion);
    const bool is_output = n % settings.output_every == 0 || n == steps || !report.converged;
    if (is_output && motion.time() > of_motion.rows.back().time) output();
    if (is_output && report.converged) ball = motion.ball_inside();
    report.converged = report.converged && !ball;
  }
  report.solve_seconds = solve.seconds();

  const Motion::Counts& counts = motion.counts();
  of_motion.steps = counts.steps - !report.converged;
  of_motion.parts = counts.parts;
  of_motion.failed_parts = counts.failed;
  of_motion.largest_gain = counts.largest_gain;
  if (counts.largest_gain > 10 * allowed_gain)
    report.warnings.push_back(
        fmt::format("in the smallest parts of steps the body gained up to {:.1g} of its energy "
                    "without work: it snapped through, or step_s is too large",
                    counts.largest_gain));
  of_motion.slowed_parts = counts.slowed;
  of_motion.largest_residual = counts.largest_residual;
  constexpr double much = 0.1;
  if (ball)
    report.reason = fmt::format(
        "at {:.6g} s the ball of {} is inside the body: it went through the surface; a larger "
        "stiffness_n_mm holds it off",
        motion.time(), ball->name());
  else if (!report.converged)
    report.reason = fmt::format("stopped at {:.6g} s: {}", motion.time(), motion.reason());
  else if (settings.newton_iterations == 0)
    report.reason = "all steps were solved to the tolerance";
  else
    report.reason = "all steps were taken, with the iterations asked";
  if (counts.largest_residual > much)
    report.warnings.push_back(
        fmt::format("residuals of up to {:.2g} are left by {} iterations a step: the motion is "
                    "slower than it should be",
                    counts.largest_residual, settings.solver_iterations));
  if (counts.slowed > 0)
    report.warnings.push_back(fmt::format(
        "{} parts of steps were slowed down, which takes momentum away: smaller steps or more iterations keep it",
        counts.slowed));
  motion.explain(report.effects);
  report.load_fraction = std::min(1.0, motion.time() / settings.duration);
  report.relative_residual = counts.relative_residual;
  NewtonReport newton;
  newton.converged = report.converged;
  newton.reason = report.reason;
  newton.iterations = counts.newton;
  newton.linear_iterations = counts.linear;
  newton.relative_residual = counts.relative_residual;
  report.levels.push_back(
      {level, motion.mesh().num_cells(), motion.mesh().num_nodes(), report.solve_seconds, newton, {}});
  hexmesh::Result result = motion.conclude(report);
  result.labels = whole.labels;  // with the islands that were left out
  return result;
}

}  // namespace hexsolver
