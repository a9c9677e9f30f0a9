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
  sums_.clear();
  number_.clear();
}

void PointHessians::add(std::int32_t cell, const NodeWeights& weights, const Mat3& hessian) {
  const auto [entry, is_new] = number_.try_emplace(static_cast<std::size_t>(cell), sums_.size());
  if (is_new) sums_.push_back({entry->first, CellMatrix::Zero()});
  add_point_product(weights.data(), weights.data(), hessian.data(), sums_[entry->second].matrix.data());
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
  if (const auto found = number_.find(cell); found != number_.end()) h += sums_[found->second].matrix;
}

std::int32_t PointHessians::shared_hessian(std::size_t cell) const {
  return number_.contains(cell) ? Term::own_hessian : Term::no_hessian;
}

std::size_t PointHessians::bytes() const {
  return hexmesh::bytes_of(sums_) + number_.size() * sizeof(*number_.begin());
}

}  // namespace hexsolver
