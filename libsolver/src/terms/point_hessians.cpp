// SPDX-License-Identifier: Apache-2.0
#include "terms/point_hessians.h"

#include "hexmesh/core/bytes.h"
#include "kernels/cell_hessian.h"

namespace hexsolver {

CellVector spread_to_nodes(const NodeWeights& weights, const Vec3& force) {
  CellVector v;
  for (int a = 0; a < 8; ++a) v.segment<3>(3 * a) = weights[a] * force;
  return v;
}

void PointHessians::clear() {
  for (const Sum& sum : sums_) number_[sum.cell] = -1;
  sums_.clear();
}

void PointHessians::reserve(std::size_t num_cells) {
  number_.resize(mesh_.num_cells(), -1);
  sums_.reserve(num_cells);
}

void PointHessians::add(std::int32_t cell, const NodeWeights& weights, const Mat3& hessian) {
  const std::size_t c = hexmesh::as_size(cell);
  number_.resize(mesh_.num_cells(), -1);
  if (number_[c] < 0) {
    number_[c] = static_cast<std::int32_t>(sums_.size());
    sums_.push_back({c, CellMatrix::Zero()});
  }
  add_point_product(weights.data(), weights.data(), hessian.data(), sums_[hexmesh::as_size(number_[c])].matrix.data());
}

template <class Vector>
void PointHessians::add_product_of(const Vector& x, Vector& y) const {
  using Real = typename Vector::Scalar;
  for (const Sum& sum : sums_) {
    const CellVector of_cell = mesh_.gather(sum.cell, x).template cast<double>();
    CellVector product;
    multiply24(sum.matrix.data(), of_cell.data(), product.data());
    mesh_.scatter_add(sum.cell, product.template cast<Real>().eval(), y);
  }
}
template void PointHessians::add_product_of(const NodeVector& x, NodeVector& y) const;
template void PointHessians::add_product_of(const FloatNodeVector& x, FloatNodeVector& y) const;

void PointHessians::add_cell_hessian(std::size_t cell, CellMatrix& h) const {
  if (shared_hessian(cell) == Term::own_hessian) h += sums_[hexmesh::as_size(number_[cell])].matrix;
}

std::int32_t PointHessians::shared_hessian(std::size_t cell) const {
  return number_.empty() || number_[cell] < 0 ? Term::no_hessian : Term::own_hessian;
}

std::size_t PointHessians::bytes() const { return hexmesh::bytes_of(sums_) + hexmesh::bytes_of(number_); }

}  // namespace hexsolver
