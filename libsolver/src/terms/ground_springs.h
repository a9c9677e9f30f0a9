// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>
#include <vector>

#include "hexmesh/core/bytes.h"
#include "terms/term.h"

namespace hexsolver {

/// Springs on the nodes of some cells to where these were, W = 1/2 sum_cells k sum_a |u_a - v_a|^2, v = 0 at first:
/// what holds parts that nothing else holds, or slows those that nothing but obstacles holds from one round to the
/// next.
class GroundSprings final : public Term {
public:
  /// @param mesh       must outlive this
  /// @param effect     that calls for them
  /// @param stiffness  cells, ascending, and their k [N/mm]
  GroundSprings(EffectKind effect, const Mesh& mesh, std::vector<std::pair<std::int32_t, double>> stiffness)
      : effect_(effect), mesh_(mesh), stiffness_(std::move(stiffness)) {}

  /// v = u. Where that moves it on and on the same way the springs are softer from then on, to and fro stiffer.
  void anchor(const NodeVector& u);
  /// Until the next anchor() they hardly pull: what obstacles stop rests on these alone.
  void fade() { faded_ = 1.0 / 1024; }
  void unfade() { faded_ = 1; }

  EffectKind effect() const override { return effect_; }
  std::size_t bytes() const override {
    return hexmesh::bytes_of(stiffness_) + sizeof(double) * static_cast<std::size_t>(anchor_.size() + moved_.size());
  }
  double energy(const NodeVector& u) const override;
  void add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const override;
  void add_product(const NodeVector& x, NodeVector& y) const override;
  void add_product(const FloatNodeVector& x, FloatNodeVector& y) const override;
  void add_cell_hessian(std::size_t cell, CellMatrix& h) const override;
  std::int32_t shared_hessian(std::size_t cell) const override;

  Vec3 force(const NodeVector& u) const;  ///< on the body [N]

private:
  template <class Vector>
  void add_product_of(const Vector& x, Vector& y) const;

  double factor() const { return factor_ * faded_; }
  double of_cell(std::size_t cell) const;  ///< 0 for a cell without springs
  CellVector drawn(std::int32_t cell, const NodeVector& u) const {
    const CellVector at = mesh_.gather(cell, u);
    return anchor_.size() == 0 ? at : CellVector(at - mesh_.gather(cell, anchor_));
  }

  EffectKind effect_;
  const Mesh& mesh_;
  std::vector<std::pair<std::int32_t, double>> stiffness_;
  NodeVector anchor_;  ///< v; empty: zero
  NodeVector moved_;   ///< by the last anchor()
  double factor_ = 1;  ///< of the stiffness
  double faded_ = 1;   ///< likewise
};

}  // namespace hexsolver
