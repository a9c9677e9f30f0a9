// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "multigrid/kept_multigrid.h"
#include "newton/newton.h"
#include "terms/elastic.h"

namespace hexsolver {

/// The equations for the shape without load of a level whose lattice shows the body under load: where U its nodes are
/// at rest such that the forces at u = 0 balance, P r(U) = 0, H U = 0.
///
/// r is no gradient in U. Its derivative, J = d2W / du dU, is taken from differences. With f = dX / dx a step w of the
/// places at rest is one of -F w of the places under load: J w is near to -K f^-1 w, K = d2W / du2, so f times one
/// V-cycle preconditions it, f averaged to the nodes. Source: Govindjee, Mihalic, Comput. Methods Appl. Mech. Engrg.
/// 136 (1996) 47, for the inverse problem; Knoll, Keyes, J. Comput. Phys. 193 (2004) 357, for the differences.
class RestEquations : public NewtonProblem<NodeVector> {
public:
  /// All must outlive this.
  /// @param potential    at the loads that act
  /// @param elastic      of the potential; at rest at the U that was last linearized at
  /// @param constraints  that prescribe nothing but zero
  RestEquations(const Hierarchy& hierarchy, Potential& potential, ElasticCells& elastic,
                const Constraints& constraints);

  /// How linear solutions are to end; see NewtonOptions.
  void set_limits(int max_linear_iterations, std::function<bool()> interrupt);

  NodeVector make_field() const override { return {}; }
  bool is_linear() const override { return false; }
  bool is_conservative() const override { return false; }
  double energy(const NodeVector& /*u*/) override { return 0; }

  /// -r, so that its derivative is near to K; not a number where material would be inside out at rest.
  double gradient(const NodeVector& to_rest, NodeVector& gradient) override;

  double rounding() const override { return potential_.rounding(); }
  double rounding(const NodeVector& /*u*/) const override { return potential_.rounding(); }
  double energy_rounding() const override { return 0; }
  double measure(const NodeVector& projected_gradient) const override;  ///< of the step that it calls for, about [mm]
  void project(NodeVector& v) const override { constraints_.project(v); }
  bool lift(const NodeVector& u, NodeVector& step) override;
  void linearize(const NodeVector& to_rest, double projection, bool is_near) override;
  void apply(const NodeVector& x, NodeVector& y) const override;
  LinearOutcome solve(const NodeVector& right_side, const LinearGoal<NodeVector>& goal, NodeVector& step) override;
  bool precondition(const NodeVector& u, double projection, const NodeVector& residual, NodeVector& step) override;

  NewtonSeconds seconds() const;
  std::size_t preconditioner_bytes() const { return multigrid_.bytes(); }

private:
  static constexpr int most_iterations = 40;  ///< of a step: most take 2 to 15, and what takes more leads astray

  double balance(const NodeVector& to_rest, NodeVector& gradient) const;
  void average_gradients();
  bool step_for(const NodeVector& right_side, NodeVector& step) const;

  Potential& potential_;
  ElasticCells& elastic_;
  const Constraints& constraints_;
  mutable KeptMultigrid multigrid_;
  std::vector<Mat3> to_rest_gradient_;  ///< f at each node
  NodeVector loads_, load_magnitude_;   ///< gradient of all terms but the cells', at u = 0 [N]
  NodeVector at_, gradient_at_;         ///< of the last linearize()
  int max_linear_iterations_ = most_iterations;
  std::function<bool()> interrupt_;
  mutable NewtonSeconds seconds_;
};

}  // namespace hexsolver
