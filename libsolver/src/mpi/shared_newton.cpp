// SPDX-License-Identifier: Apache-2.0
#include "shared_newton.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "../clamping.h"
#include "../stopwatch.h"

namespace hexsolver::mpi {
namespace {

/// One call of minimize().
class Minimizer {
public:
  Minimizer(SharedLevel& level, const NewtonOptions& options, const NewtonProgress& progress)
      : level_(level),
        options_(options),
        progress_(progress),
        gradient_(level.make_vector()),
        function_(level.make_vector()) {
    check(SNESCreate(level.all().comm(), snes_.address()));
    check(SNESSetFunction(snes_, function_, function, this));
    check(SNESSetJacobian(snes_, level.product(), level.matrix(), jacobian, this));
    check(SNESSetConvergenceTest(snes_, test, this, nullptr));
    check(SNESSetTolerances(snes_, 0, 0, 0, options.max_iterations, PETSC_DEFAULT));
    SNESLineSearch search = nullptr;
    check(SNESGetLineSearch(snes_, &search));
    check(SNESLineSearchSetType(search, SNESLINESEARCHSHELL));
    check(SNESLineSearchShellSetUserFunc(search, search_line, this));
    check(SNESGetKSP(snes_, &ksp_));
    check(KSPSetType(ksp_, KSPCG));
    check(KSPSetNormType(ksp_, KSP_NORM_UNPRECONDITIONED));
    choose_preconditioner();
    check(SNESSetFromOptions(snes_));
    check_options();
    offer_levels();
    check(SNESSetUp(snes_));
  }

  NewtonReport run(Vec u, Vec remaining);

private:
  static Minimizer& self(void* context) { return *static_cast<Minimizer*>(context); }
  static PetscErrorCode function(SNES, Vec u, Vec f, void* context) {
    self(context).residual(u, f);
    return 0;
  }
  static PetscErrorCode jacobian(SNES, Vec u, Mat, Mat, void* context) {
    self(context).linearize(u, true);
    return 0;
  }
  static PetscErrorCode test(SNES, PetscInt, PetscReal, PetscReal, PetscReal, SNESConvergedReason* reason,
                             void* context) {
    *reason = self(context).relative_ <= self(context).options_.tolerance ? SNES_CONVERGED_FNORM_ABS
                                                                          : SNES_CONVERGED_ITERATING;
    return 0;
  }
  static PetscErrorCode search_line(SNESLineSearch search, void* context) {
    self(context).search_line(search);
    return 0;
  }

  void choose_preconditioner();
  void check_options();
  void offer_levels();
  void coarsen();
  void residual(Vec u, Vec f);
  void linearize(Vec u, bool supports_hold);
  void search_line(SNESLineSearch search);
  bool move_supports(Vec u, NewtonReport& report, bool& holds);
  bool move(Vec u, Vec step);
  int count_linear_iterations();
  bool met_negative_curvature() const;

  SharedLevel& level_;
  const NewtonOptions& options_;
  const NewtonProgress& progress_;
  OwnedSnes snes_;
  KSP ksp_ = nullptr;
  PetscBool has_our_levels_ = PETSC_FALSE;
  std::vector<OwnedMat> coarse_;  ///< of our levels, [0]: the next to the finest
  OwnedVec gradient_, function_;
  Clamping clamping_;
  double relative_ = 0;
  int linear_iterations_ = 0, steps_ = 0;
  NewtonSeconds seconds_;
};

/// Multigrid on our levels; of a level too small for that a factor.
void Minimizer::choose_preconditioner() {
  PC pc = nullptr;
  check(KSPGetPC(ksp_, &pc));
  const auto& onto = level_.interpolations();
  if (onto.empty()) {
    check(PCSetType(pc, level_.all().count() > 1 ? PCREDUNDANT : PCCHOLESKY));
    return;
  }
  check(PCSetType(pc, PCMG));
  check(PCMGSetLevels(pc, static_cast<PetscInt>(onto.size()) + 1, nullptr));
  check(PCSetUseAmat(pc, PETSC_TRUE));  // the finest level keeps supports exactly
}

bool is_given(const char* option) {
  PetscBool given = PETSC_FALSE;
  check(PetscOptionsHasName(nullptr, nullptr, option, &given));
  return given == PETSC_TRUE;
}

[[noreturn]] void refuse(const std::string& option, const std::string& expected) {
  throw SharedError(hexmesh::ErrorKind::usage,
                    "PETSc's option " + option + " is not for hexsolve-mpi, expected " + expected);
}

/// Refuse what would find something else than hexsolve does, or nothing.
void Minimizer::check_options() {
  const std::string newton = "Newton's method with our line search";
  SNESType type = nullptr;
  check(SNESGetType(snes_, &type));
  if (std::string(type) != SNESNEWTONLS) refuse("-snes_type " + std::string(type), newton);
  SNESLineSearch search = nullptr;
  check(SNESGetLineSearch(snes_, &search));
  SNESLineSearchType search_type = nullptr;
  check(SNESLineSearchGetType(search, &search_type));
  if (std::string(search_type) != SNESLINESEARCHSHELL)
    refuse("-snes_linesearch_type " + std::string(search_type), newton);
  for (const char* option : {"-snes_max_it", "-snes_rtol", "-snes_atol", "-snes_stol"})
    if (is_given(option)) refuse(option, "solve.tolerance in the scene");
  if (is_given("-pc_mg_levels")) refuse("-pc_mg_levels", "the levels there are");
}

/// After PETSc's options, which may have asked for something else.
void Minimizer::offer_levels() {
  PC pc = nullptr;
  check(KSPGetPC(ksp_, &pc));
  check(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(pc), PCMG, &has_our_levels_));
  if (has_our_levels_ == PETSC_FALSE) return;
  const auto& onto = level_.interpolations();
  const auto count = static_cast<PetscInt>(onto.size());
  for (PetscInt l = 0; l < count; ++l) check(PCMGSetInterpolation(pc, count - l, onto[static_cast<std::size_t>(l)]));
}

/// Galerkin products of the matrix as it is now.
void Minimizer::coarsen() {
  if (has_our_levels_ == PETSC_FALSE) return;
  PC pc = nullptr;
  check(KSPGetPC(ksp_, &pc));
  const auto& onto = level_.interpolations();
  const bool is_first = coarse_.empty();
  coarse_.resize(onto.size());
  Mat fine = level_.matrix();
  for (std::size_t l = 0; l < onto.size(); ++l) {
    check(MatPtAP(fine, onto[l], is_first ? MAT_INITIAL_MATRIX : MAT_REUSE_MATRIX, 2, coarse_[l].address()));
    fine = coarse_[l];
    check(MatSetBlockSize(fine, 3));
    KSP smoother = nullptr;
    check(PCMGGetSmoother(pc, static_cast<PetscInt>(onto.size() - 1 - l), &smoother));
    check(KSPSetOperators(smoother, fine, fine));
  }
}

/// f = P g, and its size over that of what it sums up.
void Minimizer::residual(Vec u, Vec f) {
  const Stopwatch watch;
  const double magnitude = level_.gradient(u, f);
  level_.project(f);
  const double balanced = magnitude + level_.rounding(u) / options_.tolerance;
  relative_ = balanced == 0 ? 0 : norm(f) / balanced;
  seconds_.forces += watch.seconds();
}

/// At u, with the tolerance that the next step can use.
void Minimizer::linearize(Vec u, bool supports_hold) {
  const Stopwatch watch;
  level_.linearize(u, clamping_.now());
  level_.assemble();
  coarsen();
  seconds_.linearize += watch.seconds();
  // Of a linear problem a second step brings what the first one, whose residual is not known yet, has left.
  const bool is_linear = level_.is_linear();
  double forcing = std::max(is_linear ? 1e-6 : 1e-3, 0.1 * options_.tolerance);
  if (supports_hold)
    forcing = std::max(is_linear ? 0 : std::min(relative_ * 10, 0.05), 0.1 * options_.tolerance / relative_);
  // What PETSc's options say goes first.
  check(KSPSetTolerances(ksp_, is_given("-ksp_rtol") ? PETSC_DEFAULT : forcing, PETSC_DEFAULT, PETSC_DEFAULT,
                         is_given("-ksp_max_it") ? PETSC_DEFAULT : options_.max_linear_iterations));
}

/// Backtracks from u - step until the energy falls enough (Armijo), or the residual where there is no energy.
void Minimizer::search_line(SNESLineSearch search) {
  Vec u = nullptr, f = nullptr, step = nullptr, trial = nullptr, next = nullptr;
  check(SNESLineSearchGetVecs(search, &u, &f, &step, &trial, &next));
  const int iterations = count_linear_iterations();
  level_.project(step);  // what the supports hold has no meaning in it
  const bool has_energy = level_.is_conservative();
  const double before = level_.energy(u), slope = -dot(f, step), size = norm(f);
  const double rounding = 1e-13 * std::abs(before) + level_.rounding() * norm(step, NORM_INFINITY);
  const double shortest = has_energy ? 1e-4 : 1e-2;
  for (double length = 1; length >= shortest; length /= 2) {
    check(VecWAXPY(trial, -length, step, u));
    if (has_energy && !(level_.energy(trial) <= before + 1e-4 * length * slope + rounding)) continue;
    residual(trial, next);
    if (!has_energy && !(norm(next) < (1 - 1e-4 * length) * size)) continue;
    check(VecCopy(trial, u));
    check(VecCopy(next, f));
    check(SNESLineSearchSetReason(search, SNES_LINESEARCH_SUCCEEDED));
    check(SNESLineSearchSetNorms(search, norm(u), norm(f), norm(step)));
    clamping_.adapt(length == 1, relative_);
    ++steps_;
    if (progress_) progress_(steps_, relative_, iterations);
    return;
  }
  check(SNESLineSearchSetReason(search, SNES_LINESEARCH_FAILED_REDUCT));
}

int Minimizer::count_linear_iterations() {
  PetscInt iterations = 0;
  check(KSPGetIterationNumber(ksp_, &iterations));
  linear_iterations_ += static_cast<int>(iterations);
  return static_cast<int>(iterations);
}

bool Minimizer::met_negative_curvature() const {
  KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
  check(KSPGetConvergedReason(ksp_, &reason));
  return reason == KSP_DIVERGED_INDEFINITE_MAT || reason == KSP_DIVERGED_INDEFINITE_PC ||
         reason == KSP_DIVERGED_NANORINF || reason == KSP_DIVERGED_PC_FAILED;
}

/// The step that brings the supports to their places and keeps the rest in balance as far as a linear step can.
bool Minimizer::move_supports(Vec u, NewtonReport& report, bool& holds) {
  const SharedConstraints& constraints = level_.constraints();
  const NodeVector held = constraints.values_of(u), missing = constraints.local().lift(held);
  holds = constraints.local().hold(missing, held);
  if (holds) return true;
  const OwnedVec supports = level_.make_vector(), right = level_.make_vector(), step = level_.make_vector();
  constraints.put(missing, supports);
  residual(u, gradient_);
  while (true) {
    linearize(u, false);
    level_.apply_unheld(supports, right);
    check(VecAXPBY(right, -1, -1, gradient_));
    level_.project(right);
    check(KSPSetOperators(ksp_, level_.product(), level_.matrix()));
    check(KSPSolve(ksp_, right, step));
    const int iterations = count_linear_iterations();
    if (!met_negative_curvature()) {
      level_.project(step);
      check(VecAXPY(step, 1, supports));
      if (!move(u, step)) {
        report.reason = "under the prescribed displacements points of the body would turn inside out";
        return false;
      }
      residual(u, gradient_);
      ++steps_;
      if (progress_) progress_(steps_, relative_, iterations);
      return true;
    }
    if (clamping_.now() == Hessian::clamped) {
      report.reason = "the stiffness matrix is not positive definite (missing supports?)";
      return false;
    }
    clamping_.add();
  }
}

/// u += step, or a part of it where the law has no meaning at its end; false if no part is possible.
bool Minimizer::move(Vec u, Vec step) {
  constexpr double shortest = 1.0 / 64;
  const OwnedVec end = level_.make_vector();
  for (double length = 1; length >= shortest; length /= 2) {
    check(VecWAXPY(end, length, step, u));
    if (!level_.is_linear() && !std::isfinite(level_.energy(end))) continue;
    check(VecCopy(end, u));
    return true;
  }
  return false;
}

NewtonReport Minimizer::run(Vec u, Vec remaining) {
  NewtonReport report;
  const Stopwatch watch;
  bool goes_on = level_.is_linear() || std::isfinite(level_.energy(u));
  if (!goes_on) report.reason = "points of the body are inside out at the start";
  // Parts of steps bring the supports nearer until they hold.
  for (bool holds = false; goes_on && !holds;) {
    goes_on = steps_ < options_.max_iterations && move_supports(u, report, holds);
    if (!goes_on && report.reason.empty()) report.reason = "too many Newton iterations before the supports hold";
  }
  while (goes_on) {
    SNESConvergedReason reason = SNES_CONVERGED_ITERATING;
    check(SNESSetTolerances(snes_, 0, 0, 0, std::max(options_.max_iterations - steps_, 1), PETSC_DEFAULT));
    check(SNESSolve(snes_, nullptr, u));
    check(SNESGetConvergedReason(snes_, &reason));
    report.converged = reason > 0;
    goes_on = false;
    if (report.converged) {
      report.reason = "residual below tolerance";
    } else if (reason == SNES_DIVERGED_LINEAR_SOLVE && met_negative_curvature()) {
      count_linear_iterations();
      goes_on = clamping_.now() != Hessian::clamped;
      report.reason = "the stiffness matrix is not positive definite (missing supports?)";
      if (goes_on) clamping_.add();
    } else if (reason == SNES_DIVERGED_LINEAR_SOLVE) {
      report.reason = "the linear equations were not solved within " + std::to_string(options_.max_linear_iterations) +
                      " iterations";
    } else if (reason == SNES_DIVERGED_LINE_SEARCH) {
      report.reason = level_.is_conservative() ? "no step lowers the energy" : "no step lowers the residual";
    } else {
      report.reason = reason == SNES_DIVERGED_MAX_IT
                          ? "too many Newton iterations (does the body buckle or fold there?)"
                          : std::string("PETSc stopped: ") + SNESConvergedReasons[reason];
    }
  }
  if (report.converged && steps_ > 0) {
    PC pc = nullptr;
    check(KSPGetPC(ksp_, &pc));
    residual(u, gradient_);
    check(PCApply(pc, gradient_, remaining));
    level_.project(remaining);
  }
  report.iterations = steps_;
  report.linear_iterations = linear_iterations_;
  report.relative_residual = relative_;
  seconds_.cycles = watch.seconds() - seconds_.forces - seconds_.linearize;  // with products and their set-up
  report.seconds = seconds_;
  return report;
}

}  // namespace

void set_default_options() {
  PetscBool has_own = PETSC_FALSE;
  check(PetscOptionsHasName(nullptr, nullptr, "-pc_type", &has_own));
  if (has_own == PETSC_TRUE) return;  // PETSc knows what goes with it
  // Chebyshev polynomials of degree 6 over [largest / 80, largest] on 3x3 blocks, as in multigrid.h; the largest by
  // Lanczos' process, of which ten steps of PETSc's own choice fell short.
  constexpr std::array<std::array<const char*, 2>, 6> defaults = {
      {{"-mg_levels_ksp_type", "chebyshev"},
       {"-mg_levels_ksp_max_it", "6"},
       {"-mg_levels_ksp_chebyshev_esteig", "0,0.01375,0,1.1"},
       {"-mg_levels_esteig_ksp_type", "cg"},
       {"-mg_levels_esteig_ksp_max_it", "16"},
       {"-mg_levels_pc_type", "pbjacobi"}}};
  for (const auto& [name, value] : defaults) {
    PetscBool is_set = PETSC_FALSE;
    check(PetscOptionsHasName(nullptr, nullptr, name, &is_set));
    if (is_set == PETSC_FALSE) check(PetscOptionsSetValue(nullptr, name, value));
  }
}

NewtonReport minimize(SharedLevel& level, const NewtonOptions& options, Vec u, Vec remaining,
                      const NewtonProgress& progress) {
  return Minimizer(level, options, progress).run(u, remaining);
}

}  // namespace hexsolver::mpi
