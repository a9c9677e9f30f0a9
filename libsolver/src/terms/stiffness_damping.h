// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "terms/elastic.h"

namespace hexsolver {

/// Stiffness-proportional damping with factor b, over a step of implicit Euler from u_0:
///
///     b / (2 h) (u - u_0)^T D (u - u_0),   D = sum_cells Q^T K Q,
///
/// Q the change of strain of the co-rotational cell where the step is linearized, so that D slows strain and not
/// rotation; D = K for small strain. D is positive semi-definite and stays what it is during the step.
class StiffnessDamping final : public Term {
public:
  /// @param cells    the elastic cells whose models it takes; must outlive this
  /// @param seconds  b
  StiffnessDamping(const ElasticCells& cells, double seconds);

  /// Begin a step of h seconds from u.
  /// @param frames_at  the displacement that Q is of
  void set_step(const NodeVector& u, double h, const NodeVector& frames_at);

  EffectKind effect() const override { return EffectKind::damping; }
  double energy(const NodeVector& u) const override;
  void add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const override;
  double rounding() const override { return stiffness_ * cells_->rounding(); }
  void add_product(const NodeVector& x, NodeVector& y) const override;
  void add_product(const FloatNodeVector& x, FloatNodeVector& y) const override;
  void add_cell_hessian(std::size_t cell, CellMatrix& h) const override;
  void add_diagonal(std::size_t cell, NodeBlocks& blocks) const override;
  std::int32_t shared_hessian(std::size_t cell) const override { return cells_->shared_hessian(cell); }
  std::size_t bytes() const override;

private:
  void product(const NodeVector& x) const;  ///< product_ = D x

  std::unique_ptr<ElasticCells> cells_;
  double seconds_;
  double stiffness_ = 0;  ///< b / h
  NodeVector start_;      ///< u_0
  mutable NodeVector moved_, product_;
  mutable FloatNodeVector single_product_;
};

}  // namespace hexsolver
