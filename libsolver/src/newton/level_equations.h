// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "multigrid/kept_multigrid.h"
#include "newton/newton.h"

namespace hexsolver {

/// The equations of one level on one process: energies by its potential, supports by its constraints, linear equations
/// by conjugate gradients with one V-cycle.
class LevelEquations : public NewtonProblem<NodeVector> {
public:
  /// All must outlive this.
  LevelEquations(const Hierarchy& hierarchy, Potential& potential, const Constraints& constraints);

  /// @param measure  in place of the norm, see size(); must live as long
  /// @param loads    how large they are, see unbalanced() [N]
  void set_measures(std::function<double(const NodeVector&)> measure, double loads) {
    measure_ = std::move(measure);
    size_of_loads_ = loads;
  }

  /// How linear solutions are to end; see NewtonOptions.
  void set_limits(int max_linear_iterations, std::function<bool()> interrupt);

  NodeVector make_field() const override { return {}; }  // sized when it is first written to
  bool is_linear() const override { return potential_.is_linear(); }
  bool is_conservative() const override { return potential_.is_conservative(); }
  double energy(const NodeVector& u) override;
  double gradient(const NodeVector& u, NodeVector& gradient) override;
  double rounding() const override { return rounding_; }
  double rounding(const NodeVector& u) const override;
  double energy_rounding() const override { return potential_.energy_rounding(); }
  double size(const NodeVector& u) const override { return measure_ ? measure_(u) : u.norm(); }
  double unbalanced(const NodeVector& projected_gradient) const override;
  void project(NodeVector& v) const override { constraints_.project(v); }
  bool lift(const NodeVector& u, NodeVector& step) override;
  double longest_step(const NodeVector& u, const NodeVector& step) override { return potential_.longest_step(u, step); }
  void linearize(const NodeVector& u, double projection, bool is_near) override;
  void apply(const NodeVector& x, NodeVector& y) const override { potential_.apply(x, y); }
  LinearOutcome solve(const NodeVector& right_side, const LinearGoal<NodeVector>& goal, NodeVector& step) override;
  bool precondition(const NodeVector& u, double projection, const NodeVector& residual, NodeVector& step) override;

  /// Of what it did since it was made; forces are told by Newton.
  NewtonSeconds seconds() const;
  std::size_t preconditioner_bytes() const { return multigrid_.bytes(); }

private:
  Potential& potential_;
  const Constraints& constraints_;
  double rounding_;
  KeptMultigrid multigrid_;
  ConjugateGradients conjugate_gradients_;
  int max_linear_iterations_ = 500;
  std::function<bool()> interrupt_;
  std::function<double(const NodeVector&)> measure_;
  double size_of_loads_ = 0;  ///< [N]
  NodeVector magnitude_;
  NewtonSeconds seconds_;
};

}  // namespace hexsolver
