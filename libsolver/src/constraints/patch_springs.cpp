// SPDX-License-Identifier: Apache-2.0
#include "constraints/patch_springs.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace hexsolver {

double PatchSprings::stiffness(const ConstraintPoint& point, const ElementModel& cell, const Mat3& edges,
                               double voxel) {
  const double h = std::cbrt(std::abs(edges.determinant())), h_0 = std::cbrt(voxel);
  const double one_minus_poisson = (3 * cell.bulk + 4 * cell.shear) / (2 * (3 * cell.bulk + cell.shear));
  const double wavelength = std::max(h - h_0, h_0 / 4);
  return 2 * std::numbers::pi * cell.shear / (one_minus_poisson * wavelength) * point.area / point.num_alike;
}

PatchSprings::PatchSprings(const Mesh& mesh, const std::vector<ConstraintPoint>& points)
    : mesh_(mesh), points_(points), hessians_(mesh) {
  for (const ConstraintPoint& p : points_)
    if (p.spring > 0) hessians_.add(p.cell, p.weights, p.spring * Mat3::Identity());
}

double PatchSprings::energy(const NodeVector& u) const {
  double sum = 0;
  for (const ConstraintPoint& p : points_)
    if (p.spring > 0) sum += pull(p, u).squaredNorm() / (2 * p.spring);
  return sum;
}

double PatchSprings::work_of_motion(const NodeVector& u, const std::function<Vec3(const ConstraintPoint&)>& way) const {
  double work = 0;
  for (const ConstraintPoint& p : points_)
    if (p.spring > 0) work += pull(p, u).dot(way(p));
  return work;
}

void PatchSprings::add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const {
  for (const ConstraintPoint& p : points_) {
    if (p.spring == 0) continue;
    const CellVector force = spread_to_nodes(p.weights, -pull(p, u));
    mesh_.scatter_add(static_cast<std::size_t>(p.cell), force, gradient);
    mesh_.scatter_add(static_cast<std::size_t>(p.cell), force.cwiseAbs(), magnitude);
  }
}

}  // namespace hexsolver
