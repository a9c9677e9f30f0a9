// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "terms/elastic.h"

namespace hexsolver {

/// Small strain: W(u) = 1/2 u^T K u.
class CauchyCells final : public ElasticCells {
public:
  using ElasticCells::ElasticCells;
  explicit CauchyCells(const ElasticCells& same) : ElasticCells(same) {}
  double cell_energy(std::size_t cell, const NodeVector& u) const override;
  Mat3 stress(std::size_t cell, const NodeVector& u) const override;
  void add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const override;
  void add_product(const NodeVector& x, NodeVector& y) const override;
  void add_product(const FloatNodeVector& x, FloatNodeVector& y) const override;
  void add_cell_hessian(std::size_t cell, CellMatrix& h) const override { h += model(cell).stiffness; }
  void add_diagonal(std::size_t cell, NodeBlocks& blocks) const override;
  Dilatation dilatation(std::size_t cell) const override { return rotated_dilatation(cell, Mat3::Identity()); }
  std::int32_t shared_hessian(std::size_t cell) const override { return elements_[cell]; }
  bool adds_displacements_alone() const override { return is_at_rest_on_lattice(); }

private:
  std::optional<CellVector> force_on_lattice(std::size_t cell, const CellVector& to_unstressed) const override;
};

}  // namespace hexsolver
