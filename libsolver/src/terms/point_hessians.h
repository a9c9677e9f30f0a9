// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "terms/term.h"

namespace hexsolver {

/// A force at a point of a cell on the nodes of the cell, H^T f.
CellVector spread_to_nodes(const NodeWeights& weights, const Vec3& force);

/// Second derivatives of an energy of embedded points, sum_p H_p^T A_p H_p, as one matrix for each cell.
class PointHessians {
public:
  explicit PointHessians(const Mesh& mesh) : mesh_(mesh) {}  ///< `mesh` must outlive this

  void clear();
  /// So that points of so many cells take no memory later.
  void reserve(std::size_t num_cells);
  void add(std::int32_t cell, const NodeWeights& weights, const Mat3& hessian);

  // As of a Term:
  void add_product(const NodeVector& x, NodeVector& y) const { add_product_of(x, y); }
  void add_product(const FloatNodeVector& x, FloatNodeVector& y) const { add_product_of(x, y); }
  void add_cell_hessian(std::size_t cell, CellMatrix& h) const;
  std::int32_t shared_hessian(std::size_t cell) const;
  std::size_t bytes() const;

private:
  struct Sum {
    std::size_t cell;
    CellMatrix matrix;
  };
  template <class Vector>
  void add_product_of(const Vector& x, Vector& y) const;

  const Mesh& mesh_;
  std::vector<Sum> sums_;
  std::vector<std::int32_t> number_;  ///< of each cell in sums_, -1: none; empty before the first is added
};

}  // namespace hexsolver
