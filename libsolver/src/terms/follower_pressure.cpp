// SPDX-License-Identifier: Apache-2.0
#include "terms/follower_pressure.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "core/parallel.h"
#include "core/rotation.h"
#include "hexmesh/core/bytes.h"

namespace hexsolver {

FollowerPressure::FollowerPressure(std::string name, const Mesh& mesh, const std::vector<SurfacePoint>& faces,
                                   const Selector& selector, double pressure, bool is_closed)
    : name_(std::move(name)), mesh_(mesh), full_(pressure), pressure_(pressure), is_closed_(is_closed) {
  std::vector<SurfacePoint> sorted = faces;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const SurfacePoint& a, const SurfacePoint& b) { return a.cell < b.cell; });
  for (const SurfacePoint& face : sorted) {
    center_ += mesh.rest_position(face.cell, face.weights) / static_cast<double>(sorted.size());
    const auto cell = static_cast<std::size_t>(face.cell);
    if (cells_.empty() || cells_.back().cell != cell) cells_.push_back({cell, points_.size(), 0});
    for (const NodeWeights& weights : selector.gauss_points(face)) {
      points_.push_back({hexmesh::local_position(weights), face.area / 4});
    }
    cells_.back().end = points_.size();
  }
}

void FollowerPressure::set_factor(const Vec3& factor) { pressure_ = factor[0] * full_; }

FollowerPressure::At FollowerPressure::at(const Point& p, std::size_t cell, const CellVector& v) const {
  At out;
  out.weights = hexmesh::shape_functions(p.local);
  out.gradients = hexmesh::shape_gradients(p.local) * mesh_.edges(cell).inverse();
  out.f = Mat3::Identity() + Eigen::Map<const Eigen::Matrix<double, 3, 8>>(v.data()) * out.gradients;
  const auto column = [&](int d) -> Vec3 { return out.f.col(d); };
  out.area = p.area[0] * column(1).cross(column(2)) + p.area[1] * column(2).cross(column(0)) +
             p.area[2] * column(0).cross(column(1));
  return out;
}

Vec3 FollowerPressure::total(const NodeVector& u) const {
  Vec3 sum = Vec3::Zero();
  for (const Cell& c : cells_) {
    const CellVector v = mesh_.gather(c.cell, u);
    for (std::size_t p = c.begin; p < c.end; ++p) sum -= pressure_ * at(points_[p], c.cell, v).area;
  }
  return sum;
}

double FollowerPressure::energy(const NodeVector& u) const {
  double sum = 0;
  for (const Cell& c : cells_) {
    const CellVector v = mesh_.gather(c.cell, u);
    for (std::size_t p = c.begin; p < c.end; ++p) {
      const At here = at(points_[p], c.cell, v);
      const auto number = static_cast<std::int32_t>(c.cell);
      const Vec3 x = mesh_.rest_position(number, here.weights) + mesh_.interpolate(number, here.weights, u) - center_;
      sum += x.dot(here.area);
      // From rest, so that no digits are lost.
      sum -= (mesh_.rest_position(number, here.weights) - center_).dot(points_[p].area);
    }
  }
  return pressure_ / 3 * sum;
}

void FollowerPressure::add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const {
  for (const Cell& c : cells_) {
    const CellVector v = mesh_.gather(c.cell, u);
    CellVector force = CellVector::Zero(), size = force;
    for (std::size_t p = c.begin; p < c.end; ++p) {
      const At here = at(points_[p], c.cell, v);
      for (int a = 0; a < 8; ++a) {
        const Vec3 part = pressure_ * here.weights[a] * here.area;
        force.segment<3>(3 * a) += part;
        size.segment<3>(3 * a) += part.cwiseAbs();
      }
    }
    mesh_.scatter_add(c.cell, force, gradient);
    mesh_.scatter_add(c.cell, size, magnitude);
  }
}

/// With g_b the gradient of N_b, d(cof(F) dA) = sum_b du_b x (F (dA x g_b)).
void FollowerPressure::linearize(const NodeVector& u, double projection) {
  hessians_.clear();
  const double part = std::max(0.0, 1 - projection);
  if (pressure_ == 0 || part == 0) return;
  hessians_.assign(cells_.size(), CellMatrix::Zero());
  parallel_for(cells_.size(), [&](std::ptrdiff_t number) {
    const auto n = static_cast<std::size_t>(number);
    const Cell& c = cells_[n];
    const CellVector v = mesh_.gather(c.cell, u);
    for (std::size_t p = c.begin; p < c.end; ++p) {
      const At here = at(points_[p], c.cell, v);
      std::array<Mat3, 8> turns;
      for (int b = 0; b < 8; ++b)
        turns[static_cast<std::size_t>(b)] =
            cross_matrix(here.f * points_[p].area.cross(Vec3(here.gradients.row(b).transpose())));
      for (int a = 0; a < 8; ++a)
        for (int b = 0; b < 8; ++b)
          hessians_[n].block<3, 3>(3 * a, 3 * b) += part * pressure_ / 2 *
                                                    (here.weights[b] * turns[static_cast<std::size_t>(a)] -
                                                     here.weights[a] * turns[static_cast<std::size_t>(b)]);
    }
  });
}

template <class Vector>
void FollowerPressure::add_product_of(const Vector& x, Vector& y) const {
  using Real = typename Vector::Scalar;
  for (std::size_t n = 0; n < hessians_.size(); ++n) {
    const CellVector v = mesh_.gather(cells_[n].cell, x).template cast<double>();
    mesh_.scatter_add(cells_[n].cell, (hessians_[n] * v).template cast<Real>().eval(), y);
  }
}

const FollowerPressure::Cell* FollowerPressure::find(std::size_t cell) const {
  const auto found = std::lower_bound(cells_.begin(), cells_.end(), cell,
                                      [](const Cell& c, std::size_t value) { return c.cell < value; });
  return found != cells_.end() && found->cell == cell ? &*found : nullptr;
}

void FollowerPressure::add_cell_hessian(std::size_t cell, CellMatrix& h) const {
  if (hessians_.empty()) return;
  if (const Cell* c = find(cell)) h += hessians_[static_cast<std::size_t>(c - cells_.data())];
}

std::int32_t FollowerPressure::shared_hessian(std::size_t cell) const {
  return !hessians_.empty() && find(cell) ? own_hessian : no_hessian;
}

std::size_t FollowerPressure::bytes() const {
  return hexmesh::bytes_of(points_) + hexmesh::bytes_of(cells_) + hexmesh::bytes_of(hessians_);
}

}  // namespace hexsolver
