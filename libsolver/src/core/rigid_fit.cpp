// SPDX-License-Identifier: Apache-2.0
#include "core/rigid_fit.h"

#include "core/rotation.h"

namespace hexsolver {
namespace {

using VectorMap = Eigen::Map<Vec3>;
using MatrixMap = Eigen::Map<Mat3>;

}  // namespace

void RigidFit::add(double weight, const Vec3& rest, const Vec3& u) {
  double* s = sums_.data();
  const Vec3 x = from_ + rest;
  s[0] += weight;
  VectorMap(s + 1) += weight * x;
  VectorMap(s + 4) += weight * u;
  MatrixMap(s + 7) += weight * x * x.transpose();
  MatrixMap(s + 16) += weight * u * x.transpose();
}

void RigidFit::solve() {
  double* s = sums_.data();
  const double weight = s[0];
  if (!(weight > 0)) return;
  const Vec3 rest = VectorMap(s + 1) / weight, u = VectorMap(s + 4) / weight;
  const Mat3 spread = MatrixMap(s + 7) / weight - rest * rest.transpose();
  const Mat3 moved = spread + (MatrixMap(s + 16) / weight - u * rest.transpose());
  const double size = spread.trace();
  if (size > 0) rotation_ = polar_decomposition(3 * moved / size).rotation;
  shift_ = rest + u - rotation_ * rest;
}

Eigen::Isometry3d RigidFit::motion() const {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.linear() = rotation_;
  motion.translation() = shift_;
  return motion;
}

}  // namespace hexsolver
