// SPDX-License-Identifier: Apache-2.0
#include "core/rotation.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace hexsolver {
namespace {

/// The last of the directions v in which F flips, singular values sigma descending. Where more than one are equal to
/// the smallest, the nearest to the first axis of z, y, x that is near: cells that are mirrored alike then flip alike.
Vec3 flipped_direction(const Mat3& v, const Vec3& sigma) {
  constexpr double equal = 1e-11;
  if (sigma[1] - sigma[2] > equal * sigma[0]) return v.col(2);
  const bool all_equal = sigma[0] - sigma[2] <= equal * sigma[0];
  for (int axis = 2; axis >= 0; --axis) {
    Vec3 near = Vec3::Unit(axis);
    if (!all_equal) near -= v(axis, 0) * v.col(0);
    if (near.norm() > 0.5) return near.normalized();
  }
  return v.col(2);
}

/// For any F, by singular values.
Polar by_singular_values(const Mat3& f) {
  Eigen::JacobiSVD<Mat3> svd(f, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Mat3 u = svd.matrixU(), v = svd.matrixV();
  Vec3 sigma = svd.singularValues();  // descending
  if (u.determinant() * v.determinant() < 0) {
    const Vec3 flipped = flipped_direction(v, sigma);
    if (flipped != v.col(2)) {
      const Mat3 q = u * v.transpose();
      const Vec3 first = v.col(0) - flipped * flipped.dot(v.col(0));
      const Vec3 kept = first.norm() > 0.5 ? Vec3(first.normalized()) : flipped.unitOrthogonal();
      v << kept, flipped.cross(kept), flipped;
      u = q * v;
    }
    u.col(2) = -u.col(2);
    sigma[2] = -sigma[2];
  }
  Polar polar;
  polar.rotation = u * v.transpose();
  polar.stretch = v * sigma.asDiagonal() * v.transpose();
  Vec3 m;
  for (int i = 0; i < 3; ++i) m[i] = std::max(sigma[(i + 1) % 3] + sigma[(i + 2) % 3], polar_floor);
  polar.inverse_m = v * m.cwiseInverse().asDiagonal() * v.transpose();
  return polar;
}

}  // namespace

Polar polar_decomposition(const Mat3& f) {
  // Higham's iteration R <- (R + R^-T) / 2 while F is far from flat.
  const double scale = f.squaredNorm() / 3;
  if (!(f.determinant() > polar_least_jacobian * scale * std::sqrt(scale) && scale > polar_least_scale))
    return by_singular_values(f);
  Mat3 r = f;
  for (int iteration = 0; iteration < 20; ++iteration) {
    const Mat3 next = 0.5 * (r + r.inverse().transpose());
    const double change = (next - r).squaredNorm();
    r = next;
    if (change < polar_settled) break;
  }
  Polar polar;
  polar.rotation = r;
  const Mat3 s = r.transpose() * f;
  polar.stretch = 0.5 * (s + s.transpose());
  Mat3 m = -polar.stretch;
  m.diagonal().array() += polar.stretch.trace();
  polar.inverse_m = m.inverse();
  // The bound on det F keeps sigma_i + sigma_j of well-shaped cells above the floor; others take the exact way.
  if (polar.inverse_m.norm() * polar_floor > 1) return by_singular_values(f);
  return polar;
}

double rotation_angle(const Mat3& rotation) { return std::acos(std::clamp((rotation.trace() - 1) / 2, -1.0, 1.0)); }

Mat3 orthonormalized(const Mat3& f) {
  constexpr double flat = 1e-9;
  Mat3 r;
  r.col(0) = f.col(0).norm() > flat ? Vec3(f.col(0).normalized()) : Vec3::UnitX();
  Vec3 second = f.col(1) - r.col(0) * r.col(0).dot(f.col(1));
  if (!(second.norm() > flat * std::max(1.0, f.col(1).norm()))) {
    Eigen::Index axis = 0;
    r.col(0).cwiseAbs().minCoeff(&axis);
    second = Vec3::Unit(axis) - r.col(0) * r(axis, 0);
  }
  r.col(1) = second.normalized();
  r.col(2) = r.col(0).cross(r.col(1));
  return r;
}

}  // namespace hexsolver
