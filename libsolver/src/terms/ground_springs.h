// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>
#include <vector>

#include "hexmesh/core/bytes.h"
#include "terms/term.h"

namespace hexsolver {

/// Springs to the rest position on the nodes of some cells, W = 1/2 sum_cells k sum_a |u_a|^2: what holds parts
/// that nothing else holds.
class GroundSprings final : public Term {
public:
  /// @param mesh       must outlive this
  /// @param stiffness  cells, ascending, and their k [N/mm]
  GroundSprings(const Mesh& mesh, std::vector<std::pair<std::int32_t, double>> stiffness)
      : mesh_(mesh), stiffness_(std::move(stiffness)) {}

  EffectKind effect() const override { return EffectKind::islands; }
  std::size_t bytes() const override { return hexmesh::bytes_of(stiffness_); }
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

  double of_cell(std::size_t cell) const;  ///< 0 for a cell without springs

  const Mesh& mesh_;
  std::vector<std::pair<std::int32_t, double>> stiffness_;
};

}  // namespace hexsolver
