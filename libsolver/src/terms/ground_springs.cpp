// SPDX-License-Identifier: Apache-2.0
#include "terms/ground_springs.h"

#include <algorithm>

namespace hexsolver {

void GroundSprings::anchor(const NodeVector& u) {
  constexpr double falls = 0.7, softest = 1.0 / 16;
  faded_ = 1;
  NodeVector moved = anchor_.size() == 0 ? u : NodeVector(u - anchor_);
  if (moved_.size() > 0 && moved.norm() > falls * moved_.norm())
    factor_ = moved.dot(moved_) > 0 ? std::max(factor_ / 2, softest) : std::min(2 * factor_, 1.0);
  moved_ = std::move(moved);
  anchor_ = u;
}

double GroundSprings::of_cell(std::size_t cell) const {
  const auto found = std::lower_bound(stiffness_.begin(), stiffness_.end(), cell, [](const auto& s, std::size_t c) {
    return static_cast<std::size_t>(s.first) < c;
  });
  return found != stiffness_.end() && static_cast<std::size_t>(found->first) == cell ? factor() * found->second : 0;
}

double GroundSprings::energy(const NodeVector& u) const {
  double sum = 0;
  for (const auto& [cell, k] : stiffness_) sum += factor() * k / 2 * drawn(cell, u).squaredNorm();
  return sum;
}

void GroundSprings::add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const {
  for (const auto& [cell, k] : stiffness_) {
    const CellVector force = factor() * k * drawn(cell, u);
    mesh_.scatter_add(cell, force, gradient);
    mesh_.scatter_add(cell, force.cwiseAbs(), magnitude);
  }
}

template <class Vector>
void GroundSprings::add_product_of(const Vector& x, Vector& y) const {
  for (const auto& [cell, k] : stiffness_)
    mesh_.scatter_add(cell, static_cast<typename Vector::Scalar>(factor() * k) * mesh_.gather(cell, x), y);
}

void GroundSprings::add_product(const NodeVector& x, NodeVector& y) const { add_product_of(x, y); }
void GroundSprings::add_product(const FloatNodeVector& x, FloatNodeVector& y) const { add_product_of(x, y); }

void GroundSprings::add_cell_hessian(std::size_t cell, CellMatrix& h) const { h.diagonal().array() += of_cell(cell); }

std::int32_t GroundSprings::shared_hessian(std::size_t cell) const {
  return of_cell(cell) > 0 ? own_hessian : no_hessian;
}

Vec3 GroundSprings::force(const NodeVector& u) const {
  Vec3 sum = Vec3::Zero();
  for (const auto& [cell, k] : stiffness_) {
    const CellVector v = drawn(cell, u);
    sum -= factor() * k * Eigen::Map<const Eigen::Matrix<double, 3, 8>>(v.data()).rowwise().sum();
  }
  return sum;
}

}  // namespace hexsolver
