// SPDX-License-Identifier: Apache-2.0
#include "terms/point_hessians.h"

#include <algorithm>

#include "hexmesh/core/bytes.h"

namespace hexsolver {

CellVector spread_to_nodes(const NodeWeights& weights, const Vec3& force) {
  CellVector v;
  for (int a = 0; a < 8; ++a) v.segment<3>(3 * a) = weights[a] * force;
  return v;
}

template <class Vector>
void PointHessians::add_product_of(const Vector& x, Vector& y) const {
  using Real = typename Vector::Scalar;
  for (const Point& p : points_)
    mesh_.scatter_add(
        static_cast<std::size_t>(p.cell),
        spread_to_nodes(p.weights, p.hessian * mesh_.interpolate(p.cell, p.weights, x)).template cast<Real>().eval(),
        y);
}
template void PointHessians::add_product_of(const NodeVector& x, NodeVector& y) const;
template void PointHessians::add_product_of(const FloatNodeVector& x, FloatNodeVector& y) const;

std::pair<std::size_t, std::size_t> PointHessians::in(std::size_t cell) const {
  const auto range = std::equal_range(points_.begin(), points_.end(), Point{static_cast<std::int32_t>(cell), {}, {}},
                                      [](const Point& a, const Point& b) { return a.cell < b.cell; });
  return {range.first - points_.begin(), range.second - points_.begin()};
}

void PointHessians::add_cell_hessian(std::size_t cell, CellMatrix& h) const {
  const auto [begin, end] = in(cell);
  for (std::size_t n = begin; n < end; ++n)
    for (int a = 0; a < 8; ++a)
      for (int b = 0; b < 8; ++b)
        h.block<3, 3>(3 * a, 3 * b) += points_[n].weights[a] * points_[n].weights[b] * points_[n].hessian;
}

std::int32_t PointHessians::shared_hessian(std::size_t cell) const {
  const auto [begin, end] = in(cell);
  return begin == end ? Term::no_hessian : Term::own_hessian;
}

std::size_t PointHessians::bytes() const { return hexmesh::bytes_of(points_); }

}  // namespace hexsolver
