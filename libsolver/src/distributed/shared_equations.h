// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "distributed/assembled_matrix.h"
#include "distributed/shared_level.h"
#include "multigrid/multigrid.h"
#include "multigrid/preconditioner_age.h"
#include "newton/newton.h"

namespace hexsolver::mpi {

// What Newton's method does with fields; see newton/fields.h.

inline OwnedVec copy_of(const OwnedVec& x) {
  OwnedVec out;
  check(VecDuplicate(x, out.address()));
  check(VecCopy(x, out));
  return out;
}
inline double largest(const OwnedVec& x) { return norm(x, NORM_INFINITY); }
inline void set_to(OwnedVec& to, const OwnedVec& from) { check(VecCopy(from, to)); }
inline void negate(OwnedVec& x) { check(VecScale(x, -1)); }
/// out = x + a y
inline void set_sum(OwnedVec& out, const OwnedVec& x, double a, const OwnedVec& y) {
  if (&out == &y)
    check(VecAYPX(out, a, x));
  else if (&out == &x)
    check(VecAXPY(out, a, y));
  else
    check(VecWAXPY(out, a, y, x));
}
inline void swap_fields(OwnedVec& x, OwnedVec& y) { std::swap(x, y); }

/// The equations of a level that many processes share. PETSc solves the linear ones: conjugate gradients (KSP) with
/// our multigrid (PCSHELL), unless its options ask for a preconditioner of its own.
class SharedEquations final : public NewtonProblem<OwnedVec> {
public:
  /// @param level  with its potential; must outlive this
  /// @throws SharedError{usage} of options that would find something else than hexsolve does, or nothing
  explicit SharedEquations(SharedLevel& level);

  /// How linear solutions are to end; see NewtonOptions.
  void set_limits(int max_linear_iterations, std::function<bool()> interrupt);

  OwnedVec make_field() const override { return level_.make_vector(); }
  bool is_linear() const override { return level_.is_linear(); }
  bool is_conservative() const override { return level_.is_conservative(); }
  double energy(const OwnedVec& u) override { return level_.energy(u); }
  double gradient(const OwnedVec& u, OwnedVec& gradient) override { return level_.gradient(u, gradient); }
  double rounding() const override { return level_.rounding(); }
  double rounding(const OwnedVec& u) const override { return level_.rounding(u); }
  double energy_rounding() const override { return level_.energy_rounding(); }
  void project(OwnedVec& v) const override { level_.project(v); }
  bool lift(const OwnedVec& u, OwnedVec& step) override;
  void linearize(const OwnedVec& u, double projection, bool is_near) override;
  void apply(const OwnedVec& x, OwnedVec& y) const override { level_.apply_unheld(x, y); }
  LinearOutcome solve(const OwnedVec& right_side, const LinearGoal<OwnedVec>& goal, OwnedVec& step) override;
  double unbalanced(const OwnedVec& projected_gradient) const override {
    const double loads = level_.size_of_loads();
    return loads == 0 ? 0 : level_.total(projected_gradient).norm() / loads;
  }
  double size(const OwnedVec& u) const override { return level_.size_in_material(u).mean; }
  bool precondition(const OwnedVec& u, double projection, const OwnedVec& residual, OwnedVec& step) override;

  NewtonSeconds seconds() const noexcept { return seconds_; }  ///< cycles with products

private:
  /// When a linear solution ends, as ConjugateGradients does.
  struct LinearEnding {
    const LinearGoal<OwnedVec>* goal = nullptr;
    double whole = 0, last = 0, target = 0;
    bool is_interrupted = false;
  };
  static PetscErrorCode test(KSP ksp, PetscInt iteration, PetscReal residual, KSPConvergedReason* reason,
                             void* context);
  KSPConvergedReason end_of(PetscInt iteration, double residual);

  void choose_preconditioner();
  void check_options() const;
  void renew();
  bool is_positive() const { return !multigrid_ || multigrid_->is_positive(); }
  void cycle(Vec residual, Vec step) const;
  LinearOutcome solve_once(const OwnedVec& right_side, OwnedVec& step, int most_iterations);
  PC preconditioner() const;

  SharedLevel& level_;
  OwnedKsp ksp_;
  bool has_own_multigrid_ = false;
  std::unique_ptr<Multigrid> multigrid_;
  std::unique_ptr<AssembledMatrix> matrix_;  ///< for PETSc's preconditioners
  PreconditionerAge age_;
  bool is_there_ = false;    ///< a preconditioner
  bool is_careful_ = false;  ///< the cycle there is smooths so
  int max_linear_iterations_ = 500;
  std::function<bool()> interrupt_;
  LinearEnding ending_;
  NewtonSeconds seconds_;
};

}  // namespace hexsolver::mpi
