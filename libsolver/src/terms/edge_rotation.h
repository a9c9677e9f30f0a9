// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "terms/elastic.h"

namespace hexsolver {

/// The paper's co-rotational cell: force R K (R^T x - X) with R from the averaged edges, and R K R^T for its
/// derivative. That force is no gradient of any energy; its cells have a net torque, and equilibrium is approached
/// linearly or not at all. For reproduction and comparison. Source: Nesme, Faure, Payan 2010.
class EdgeRotatedCells final : public ElasticCells {
public:
  using ElasticCells::ElasticCells;
  double cell_energy(std::size_t cell, const NodeVector& u) const override;
  Mat3 stress(std::size_t cell, const NodeVector& u) const override;
  void add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const override;
  bool is_conservative() const override { return false; }
  bool is_linear() const override { return false; }
  void linearize(const NodeVector& u, double projection) override;
  void add_product(const NodeVector& x, NodeVector& y) const override;
  void add_product(const FloatNodeVector& x, FloatNodeVector& y) const override;
  void add_cell_hessian(std::size_t cell, CellMatrix& h) const override;
  void add_diagonal(std::size_t cell, NodeBlocks& blocks) const override;
  Dilatation dilatation(std::size_t cell) const override { return rotated_dilatation(cell, rotations_[cell]); }
  std::int32_t shared_hessian(std::size_t /*cell*/) const override { return own_hessian; }
  std::size_t bytes() const override;

private:
  template <class Vector>
  void add_product_of(const Vector& x, Vector& y) const;
  Mat3 rotation(std::size_t cell, const CellVector& moved) const;  ///< of a cell whose corners are displaced by `moved`

  std::vector<Mat3> rotations_;  ///< of the last linearize()
};

}  // namespace hexsolver
