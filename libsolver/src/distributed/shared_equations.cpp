// SPDX-License-Identifier: Apache-2.0
#include "distributed/shared_equations.h"

#include <cmath>

#include "core/stopwatch.h"

namespace hexsolver::mpi {
namespace {

bool is_given(const char* option) {
  PetscBool given = PETSC_FALSE;
  check(PetscOptionsHasName(nullptr, nullptr, option, &given));
  return given == PETSC_TRUE;
}

bool is_type(PC pc, const char* type) {
  PetscBool out = PETSC_FALSE;
  check(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(pc), type, &out));
  return out == PETSC_TRUE;
}

[[noreturn]] void refuse(const std::string& option, const std::string& expected) {
  throw SharedError(hexmesh::ErrorKind::usage,
                    "PETSc's option " + option + " is not for hexsolve-mpi, expected " + expected);
}

}  // namespace

SharedEquations::SharedEquations(SharedLevel& level) : level_(level), age_(ageing_of_newton_steps) {
  check(KSPCreate(level.all().comm(), ksp_.address()));
  check(KSPSetType(ksp_, KSPCG));
  check(KSPSetNormType(ksp_, KSP_NORM_UNPRECONDITIONED));
  choose_preconditioner();
  check(KSPSetFromOptions(ksp_));
  check_options();
  has_own_multigrid_ = is_type(preconditioner(), PCSHELL);
  if (!has_own_multigrid_) matrix_ = std::make_unique<AssembledMatrix>(level);
  check(KSPSetOperators(ksp_, level.product(), has_own_multigrid_ ? level.product() : matrix_->get()));
  if (!is_given("-ksp_rtol")) check(KSPSetConvergenceTest(ksp_, test, this, nullptr));
}

void SharedEquations::set_limits(int max_linear_iterations, std::function<bool()> interrupt) {
  max_linear_iterations_ = max_linear_iterations;
  interrupt_ = std::move(interrupt);
}

PC SharedEquations::preconditioner() const {
  PC pc = nullptr;
  check(KSPGetPC(ksp_, &pc));
  return pc;
}

/// Our multigrid.
void SharedEquations::choose_preconditioner() {
  const PC pc = preconditioner();
  check(PCSetType(pc, PCSHELL));
  check(PCShellSetContext(pc, this));
  check(PCShellSetName(pc, "multigrid of hexsolve"));
  check(PCShellSetApply(pc, [](PC of, Vec residual, Vec step) {
    SharedEquations* self = nullptr;
    const PetscErrorCode code = PCShellGetContext(of, &self);
    if (code == 0) self->cycle(residual, step);
    return code;
  }));
}

void SharedEquations::cycle(Vec residual, Vec step) const {
  NodeVector z;
  multigrid_->apply(level_.part_of(residual), z);
  level_.put_own(z, step);
}

/// Newton's method is hexsolve's, whatever PETSc has.
void SharedEquations::check_options() const {
  for (const char* option : {"-snes_type", "-snes_linesearch_type", "-snes_view", "-snes_monitor"})
    if (is_given(option)) refuse(option, "Newton's method with our line search");
  for (const char* option : {"-snes_max_it", "-snes_rtol", "-snes_atol", "-snes_stol"})
    if (is_given(option)) refuse(option, "solve.tolerance in the scene");
  if (const PC pc = preconditioner(); is_type(pc, PCMG))
    refuse("-pc_type mg", "none for our multigrid, or another of PETSc's");
  if (is_given("-pc_mg_levels")) refuse("-pc_mg_levels", "the levels there are");
}

bool SharedEquations::lift(const OwnedVec& u, OwnedVec& step) {
  const SharedConstraints& constraints = level_.constraints();
  const NodeVector held = constraints.values_of(u), missing = constraints.local().lift(held);
  check(VecZeroEntries(step));
  constraints.put(missing, step);
  return constraints.local().hold(missing, held);
}

void SharedEquations::linearize(const OwnedVec& u, double projection, bool is_near) {
  if (!is_near || !is_there_) age_.wear_out();
  const Stopwatch watch;
  level_.linearize(u, projection);
  seconds_.linearize += watch.seconds();
}

void SharedEquations::renew() {
  const Stopwatch watch;
  if (has_own_multigrid_) {
    multigrid_.reset();
    multigrid_ = std::make_unique<Multigrid>(level_.hierarchy(), level_.potential(), level_.held_in_part());
  } else {
    matrix_->assemble();
    check(KSPSetReusePreconditioner(ksp_, PETSC_FALSE));
  }
  check(KSPSetUp(ksp_));
  check(KSPSetReusePreconditioner(ksp_, PETSC_TRUE));
  is_there_ = true;
  is_careful_ = false;
  age_.renew();
  seconds_.set_up += watch.seconds();
}

PetscErrorCode SharedEquations::test(KSP, PetscInt iteration, PetscReal residual, KSPConvergedReason* reason,
                                     void* context) {
  *reason = static_cast<SharedEquations*>(context)->end_of(iteration, residual);
  return 0;
}

KSPConvergedReason SharedEquations::end_of(PetscInt iteration, double residual) {
  if (!std::isfinite(residual)) return KSP_DIVERGED_NANORINF;
  if (iteration == 0) {
    ending_.whole = residual;
    ending_.target = ending_.goal->relative_tolerance * residual;
  }
  ending_.last = residual;
  if (residual <= ending_.target) {
    double factor = 1;
    if (ending_.goal->excess) {
      Vec solution = nullptr;
      check(KSPBuildSolution(ksp_, nullptr, &solution));
      const OwnedVec step = level_.make_vector();
      check(VecCopy(solution, step));
      level_.project(step);  // what the supports hold has no meaning in it
      factor = ending_.goal->excess(step);
    }
    if (!(factor > 1)) return KSP_CONVERGED_RTOL;
    ending_.target = 0.9 * residual / factor;
  }
  ending_.is_interrupted = interrupt_ && interrupt_();
  return ending_.is_interrupted ? KSP_CONVERGED_ITS : KSP_CONVERGED_ITERATING;
}

LinearOutcome SharedEquations::solve_once(const OwnedVec& right_side, OwnedVec& step, int most_iterations) {
  // What PETSc's options say goes first.
  check(KSPSetTolerances(ksp_, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT,
                         is_given("-ksp_max_it") ? PETSC_DEFAULT : most_iterations));
  check(KSPSolve(ksp_, right_side, step));
  level_.project(step);  // what the supports hold has no meaning in it
  KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
  check(KSPGetConvergedReason(ksp_, &reason));
  PetscInt iterations = 0;
  check(KSPGetIterationNumber(ksp_, &iterations));
  LinearOutcome outcome{static_cast<int>(iterations), LinearEnd::solved};
  if (ending_.is_interrupted) outcome.end = LinearEnd::interrupted;
  if (reason == KSP_DIVERGED_INDEFINITE_PC && has_own_multigrid_ && !is_careful_) {
    outcome.end = LinearEnd::indefinite_preconditioner;
    return outcome;
  }
  if (reason == KSP_DIVERGED_INDEFINITE_MAT || reason == KSP_DIVERGED_INDEFINITE_PC ||
      reason == KSP_DIVERGED_NANORINF || reason == KSP_DIVERGED_PC_FAILED) {
    outcome.end = LinearEnd::negative_curvature;
    check(VecZeroEntries(step));
  }
  const double reduction = ending_.whole > 0 ? ending_.last / ending_.whole : 0;
  age_.judge(outcome.end == LinearEnd::solved, outcome.iterations, reduction);
  return outcome;
}

LinearOutcome SharedEquations::solve(const OwnedVec& right_side, const LinearGoal<OwnedVec>& goal, OwnedVec& step) {
  const Stopwatch watch;
  const double set_up_before = seconds_.set_up;
  const OwnedVec projected = copy_of(right_side);
  level_.project(projected);
  LinearOutcome sum;
  bool is_new = false;
  for (bool is_done = false; !is_done;) {
    if (age_.is_worn()) {
      renew();
      is_new = true;
    }
    ending_ = {&goal};
    const int most =
        is_new ? max_linear_iterations_
               : age_.most_iterations(max_linear_iterations_, goal.relative_tolerance, static_cast<bool>(goal.excess));
    LinearOutcome outcome{0, LinearEnd::negative_curvature};
    if (is_positive()) {
      outcome = solve_once(projected, step, most);
    } else {
      check(VecZeroEntries(step));
      age_.wear_out();
    }
    sum.iterations += outcome.iterations;
    sum.end = outcome.end;
    if (outcome.end == LinearEnd::indefinite_preconditioner) {
      multigrid_->smooth_carefully();
      is_careful_ = true;
      continue;
    }
    is_done = is_new || outcome.end != LinearEnd::negative_curvature;  // it may be that of what was kept
  }
  seconds_.cycles += watch.seconds() - (seconds_.set_up - set_up_before);
  return sum;
}

bool SharedEquations::precondition(const OwnedVec& u, double projection, const OwnedVec& residual, OwnedVec& step) {
  level_.linearize(u, is_there_ ? projection : Hessian::projected);
  if (!is_there_) renew();
  if (!is_positive()) return false;
  check(PCApply(preconditioner(), residual, step));
  level_.project(step);
  return true;
}

}  // namespace hexsolver::mpi
