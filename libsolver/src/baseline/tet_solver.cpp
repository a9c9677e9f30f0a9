// SPDX-License-Identifier: Apache-2.0
#include "baseline/tet_solver.h"

#include <Eigen/CholmodSupport>
#include <Eigen/IterativeLinearSolvers>
#include <algorithm>
#include <cmath>
#include <optional>

#include "baseline/tet_system.h"
#include "core/stopwatch.h"

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

/// Newton's method for the loads of a problem.
class Newton {
public:
  Newton(const TetProblem& problem, const TetOptions& options, TetReport& report)
      : options_(options),
        report_(report),
        system_(problem, options.law),
        solver_(options.solver),
        load_(by_component(problem.force)) {
    Vector pull;
    const Vector rest = Vector::Zero(load_.size());
    solver_.analyze(system_.stiffness(rest, 1, rest, pull));
  }

  /// From u to equilibrium under a fraction of the loads.
  bool solve(double fraction, Vector& u);

private:
  struct State {
    TetSystem::Forces forces;
    double energy = 0;    ///< with the loads
    Vector residual;      ///< of the free components
    double relative = 0;  ///< its size
  };
  State state(const Vector& u, double fraction) const;
  std::optional<Vector> find_step(const Vector& u, const State& now, const Vector& held_step, double& clamping);
  bool search_line(Vector& u, State& now, const Vector& step, double fraction) const;

  const TetOptions& options_;
  TetReport& report_;
  TetSystem system_;
  LinearSolver solver_;
  Vector load_;
};

Newton::State Newton::state(const Vector& u, double fraction) const {
  State s{system_.forces(u)};
  s.energy = s.forces.energy - fraction * load_.dot(u);
  s.residual = system_.free_part(s.forces.gradient - fraction * load_);
  const double scale = (s.forces.magnitude + fraction * load_.cwiseAbs()).norm();
  s.relative = scale > 0 ? s.residual.norm() / scale : 0;
  return s;
}

std::optional<Vector> Newton::find_step(const Vector& u, const State& now, const Vector& held_step, double& clamping) {
  const bool supports_move = !held_step.isZero(0);
  // As sharply as the next residual can use, as for cells.
  const double tolerance = options_.law == TetLaw::cauchy ? options_.tolerance
                           : supports_move
                               ? std::max(1e-3, 0.1 * options_.tolerance)
                               : std::max(std::min(10 * now.relative, 0.05), 0.1 * options_.tolerance / now.relative);
  for (;; clamping = Hessian::projected) {
    Vector pull;
    const Matrix& k = system_.stiffness(u, clamping, held_step, pull);
    std::optional<Vector> step = solver_.solve(k, pull - now.residual, tolerance, report_.linear_iterations);
    if (step || clamping == Hessian::projected) return step;
  }
}

bool Newton::search_line(Vector& u, State& now, const Vector& step, double fraction) const {
  const bool has_energy = options_.law != TetLaw::corotational_qr;
  const double slope = now.residual.dot(step);
  for (double length = 1; length >= 1e-4; length /= 2) {
    Vector trial = u;
    system_.add_free(length * step, trial);
    State next = state(trial, fraction);
    const bool good = has_energy ? next.energy <= now.energy + 1e-4 * length * slope + 1e-12 * std::abs(now.energy)
                                 : next.residual.norm() < (1 - 1e-4 * length) * now.residual.norm();
    if (!good) continue;
    u = std::move(trial);
    now = std::move(next);
    return true;
  }
  return false;
}

bool Newton::solve(double fraction, Vector& u) {
  State now = state(u, fraction);
  double clamping = Hessian::projected;
  for (int n = 0; n < options_.max_iterations; ++n) {
    const Vector held_step = system_.held_step(u, fraction);
    const bool supports_move = !held_step.isZero(0);
    report_.relative_residual = now.relative;
    report_.strain_energy = now.forces.energy;
    report_.min_jacobian = now.forces.min_jacobian;
    if (!supports_move && now.relative <= options_.tolerance) return true;
    const std::optional<Vector> step = find_step(u, now, held_step, clamping);
    ++report_.newton_iterations;
    if (!step) {
      report_.reason = "the stiffness matrix is not positive definite";
      return false;
    }
    if (supports_move) {
      u += held_step;
      system_.add_free(*step, u);
      now = state(u, fraction);
      if (!std::isfinite(now.energy)) {
        report_.reason = "tetrahedra would turn inside out";
        return false;
      }
    } else if (!search_line(u, now, *step, fraction)) {
      report_.reason = "no step lowers the energy";
      return false;
    }
    clamping = now.relative < 1e-2 ? Hessian::exact : Hessian::projected;
  }
  report_.reason = "too many Newton iterations";
  return false;
}

}  // namespace

std::vector<Vec3> solve_tets(const TetProblem& problem, const TetOptions& options, TetReport& report) {
  report = {};
  const Stopwatch setup;
  Newton newton(problem, options, report);
  report.setup_seconds = setup.seconds();
  const Stopwatch solve;
  constexpr double least_part = 1.0 / 64;
  Vector u = Vector::Zero(3 * static_cast<Eigen::Index>(problem.mesh->points.size()));
  double part = 1;
  while (report.load_fraction < 1 && part >= least_part) {
    const double next = std::min(1.0, report.load_fraction + part);
    Vector trial = u;
    if (newton.solve(next, trial)) {
      u = std::move(trial);
      report.load_fraction = next;
    } else {
      part /= 2;
    }
  }
  report.converged = report.load_fraction == 1;
  if (report.converged) report.reason = "residual below tolerance";
  report.solve_seconds = solve.seconds();
  return by_node(u);
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
    Vector d = held_step;
    system_.add_free(conjugate_gradients(k, of_k, of_mass, b), d);
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
