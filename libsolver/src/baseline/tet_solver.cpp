// SPDX-License-Identifier: Apache-2.0
#include "baseline/tet_solver.h"

#include <Eigen/CholmodSupport>
#include <Eigen/IterativeLinearSolvers>
#include <optional>

#include "baseline/tet_system.h"
#include "core/stopwatch.h"
#include "equilibrium/load_steps.h"
#include "terms/elastic.h"

namespace hexsolver {
namespace {

using Vector = TetSystem::Vector;
using Matrix = TetSystem::Matrix;

std::vector<Vec3> by_node(const Vector& u) {
  std::vector<Vec3> out;
  for (Eigen::Index n = 0; n < u.size(); n += 3) out.emplace_back(u.segment<3>(n));
  return out;
}

Vector by_component(const std::vector<Vec3>& values) {
  Vector out(3 * static_cast<Eigen::Index>(values.size()));
  for (std::size_t n = 0; n < values.size(); ++n) out.segment<3>(3 * static_cast<Eigen::Index>(n)) = values[n];
  return out;
}

class LinearSolver {
public:
  explicit LinearSolver(TetLinearSolver kind) : kind_(kind) {
    direct_.cholmod().print = 0;
    direct_.cholmod().quick_return_if_not_posdef = 1;
  }

  void analyze(const Matrix& k) {
    if (kind_ == TetLinearSolver::cholesky) direct_.analyzePattern(k);
  }

  /// @returns nothing where K is found not to be positive definite
  std::optional<Vector> solve(const Matrix& k, const Vector& b, double tolerance, int& iterations) {
    if (kind_ == TetLinearSolver::cholesky) {
      direct_.factorize(k);
      if (direct_.info() != Eigen::Success) return {};
      return direct_.solve(b);
    }
    iterative_.setTolerance(tolerance);
    iterative_.setMaxIterations(20000);
    iterative_.compute(k);
    Vector x = iterative_.solve(b);
    iterations += static_cast<int>(iterative_.iterations());
    if (!(x.dot(b) > 0) || !x.allFinite()) return {};
    return x;
  }

private:
  TetLinearSolver kind_;
  Eigen::CholmodSupernodalLLT<Matrix, Eigen::Lower> direct_;
  Eigen::ConjugateGradient<Matrix, Eigen::Lower, Eigen::IncompleteCholesky<double>> iterative_;
};

/// The equations of tetrahedra under a fraction of their loads. Fields have all components; those of held ones are what
/// is prescribed.
class TetEquations final : public NewtonProblem<NodeVector> {
public:
  TetEquations(const TetProblem& problem, const TetOptions& options)
      : options_(options),
        system_(problem, options.law),
        solver_(options.solver),
        load_(by_component(problem.force)),
        held_step_(Vector::Zero(load_.size())) {
    solver_.analyze(system_.stiffness(held_step_, 1, held_step_, pull_));
  }

  void set_fraction(double fraction) {
    fraction_ = fraction;
    of_.resize(0);
  }
  const TetSystem::Forces& forces(const Vector& u) {
    if (of_.size() != u.size() || of_ != u) {
      forces_ = system_.forces(u);
      of_ = u;
    }
    return forces_;
  }

  Vector make_field() const override { return Vector::Zero(load_.size()); }
  bool is_linear() const override { return options_.law == TetLaw::cauchy; }
  bool is_conservative() const override { return options_.law != TetLaw::corotational_qr; }
  double energy(const Vector& u) override { return forces(u).energy - fraction_ * load_.dot(u); }
  double gradient(const Vector& u, Vector& gradient) override {
    gradient = forces(u).gradient - fraction_ * load_;
    return (forces(u).magnitude + fraction_ * load_.cwiseAbs()).norm();
  }
  double rounding() const override { return 0; }
  double rounding(const Vector& /*u*/) const override { return 0; }
  double energy_rounding() const override { return 0; }
  void project(Vector& v) const override { v = system_.only_free(system_.free_part(v)); }
  bool lift(const Vector& u, Vector& step) override {
    held_step_ = system_.held_step(u, fraction_);
    step = held_step_;
    return largest(step) <= 1e-15 * largest(u);
  }
  void linearize(const Vector& u, double projection, bool /*is_near*/) override {
    matrix_ = &system_.stiffness(u, projection, held_step_, pull_);
  }
  /// Of the step that lift() found: Newton's method asks for no other.
  void apply(const Vector& /*held_step*/, Vector& y) const override { y = system_.only_free(-pull_); }
  LinearOutcome solve(const Vector& right_side, const LinearGoal<Vector>& goal, Vector& step) override;

private:
  const TetOptions& options_;
  TetSystem system_;
  LinearSolver solver_;
  Vector load_;
  double fraction_ = 1;
  Vector held_step_, pull_;
  const Matrix* matrix_ = nullptr;
  Vector of_;  ///< what forces_ belong to
  TetSystem::Forces forces_;
};

LinearOutcome TetEquations::solve(const Vector& right_side, const LinearGoal<Vector>& goal, Vector& step) {
  const Vector b = system_.free_part(right_side);
  LinearOutcome out;
  for (double tolerance = goal.relative_tolerance;;) {
    const std::optional<Vector> free = solver_.solve(*matrix_, b, tolerance, out.iterations);
    if (!free) {
      step.setZero();
      out.end = LinearEnd::negative_curvature;
      return out;
    }
    step = system_.only_free(*free);
    const double excess = goal.excess ? goal.excess(step) : 0;
    if (!(excess > 1) || tolerance < 1e-15) return out;
    tolerance *= 0.5 / excess;
  }
}

/// What solve_in_load_steps() asks of a level.
class TetLevel {
public:
  using Vector = NodeVector;
  TetLevel(const TetProblem& problem, const TetOptions& options) : equations_(problem, options) {}

  TetEquations& equations() { return equations_; }
  bool attach(const NodeVector& /*u*/, const PullMode& /*mode*/) const { return false; }
  void keep(const NodeVector& /*u*/) const {}
  RoundLimits round_limits(Aim /*aim*/) const { return {}; }
  std::optional<std::string> gone_through(const NodeVector& /*u*/) const { return {}; }
  // Of levels with something attached:
  NodeVector make_zero() const { return equations_.make_field(); }
  ElasticCells::Size size_in_material(const NodeVector& /*field*/, bool /*with_islands*/) const { return {}; }
  double diameter() const { return 0; }
  NodeVector make_start() const { return equations_.make_field(); }
  double largest_load_step() const { return 1; }
  void set_progress(const Progress& progress) { equations_.set_fraction(progress.fraction); }
  NewtonOutcome minimize(const NewtonOptions& options, NodeVector& u, const NewtonProgress& progress) {
    return hexsolver::minimize(equations_, options, u, progress);
  }
  std::string limit_reached(const NodeVector& /*u*/, bool /*nearly*/) const { return {}; }

private:
  TetEquations equations_;
};

}  // namespace

std::vector<Vec3> solve_tets(const TetProblem& problem, const TetOptions& options, TetReport& report) {
  report = {};
  const Stopwatch setup;
  TetLevel level(problem, options);
  report.setup_seconds = setup.seconds();
  const Stopwatch solve;
  NewtonOptions newton;
  newton.tolerance = options.tolerance;
  newton.max_iterations = options.max_iterations;
  const LoadedState<NodeVector> state = solve_in_load_steps(level, newton, std::optional<NodeVector>(), {});
  report.solve_seconds = solve.seconds();
  report.converged = state.newton.converged;
  report.reason = state.newton.reason;
  report.load_fraction = state.load_fraction;
  report.newton_iterations = state.newton.iterations;
  report.linear_iterations = state.newton.linear_iterations;
  report.relative_residual = state.newton.relative_residual;
  const TetSystem::Forces& forces = level.equations().forces(state.u);
  report.strain_energy = forces.energy;
  report.min_jacobian = forces.min_jacobian;
  return by_node(state.u);
}

class TetMotion::Integrator {
public:
  Integrator(const TetProblem& problem, TetLaw law, double step, int iterations, const Damping& damping)
      : system_(problem, law),
        h_(step),
        iterations_(iterations),
        damping_(damping),
        load_(by_component(problem.force)) {
    u_ = Vector::Zero(load_.size());
    v_ = u_;
    Vector mass(load_.size());
    for (Eigen::Index n = 0; n < mass.size(); ++n) mass[n] = problem.mass[static_cast<std::size_t>(n / 3)];
    mass_ = system_.free_part(mass);
  }

  /// (M / h^2 + D / h + K) d = M v / h - gradient + load, D = mass_per_s M + stiffness_s K
  void step() {
    const Vector held_step = system_.held_step(u_, 1);
    Vector pull;
    const Matrix& k = system_.stiffness(u_, Hessian::projected, held_step, pull);
    const double of_k = 1 + damping_.stiffness_s / h_, of_mass = 1 / (h_ * h_) + damping_.mass_per_s / h_;
    const Vector b = mass_.cwiseProduct(system_.free_part(v_)) / h_ + of_k * pull -
                     system_.free_part(system_.forces(u_).gradient - load_);
    const Vector d = held_step + system_.only_free(conjugate_gradients(k, of_k, of_mass, b));
    u_ += d;
    v_ = d / h_;
  }

  const Vector& displacement() const noexcept { return u_; }

private:
  Vector conjugate_gradients(const Matrix& k, double of_k, double of_mass, const Vector& b) const {
    Vector x = Vector::Zero(b.size()), r = b, p = b, q;
    double rr = r.squaredNorm();
    for (int n = 0; n < iterations_ && rr > 0; ++n) {
      q = k.selfadjointView<Eigen::Lower>() * p;
      q = of_k * q + of_mass * mass_.cwiseProduct(p);
      const double alpha = rr / p.dot(q);
      x += alpha * p;
      r -= alpha * q;
      const double next = r.squaredNorm();
      p = r + next / rr * p;
      rr = next;
    }
    return x;
  }

  TetSystem system_;
  double h_;
  int iterations_;
  Damping damping_;
  Vector load_, mass_, u_, v_;
};

TetMotion::TetMotion(const TetProblem& problem, TetLaw law, double step, int iterations, const Damping& damping)
    : integrator_(std::make_unique<Integrator>(problem, law, step, iterations, damping)) {}
TetMotion::~TetMotion() = default;
void TetMotion::step() { integrator_->step(); }
std::vector<Vec3> TetMotion::displacement() const { return by_node(integrator_->displacement()); }

}  // namespace hexsolver
