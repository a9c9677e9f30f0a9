// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <span>

#include "hexsolver/core/vectors.h"

namespace hexsolver {

/// The rigid motion y = R x + t next to moved points, in the weighted mean square (Kabsch, Acta Cryst. A32 (1976) 922).
/// Of points on a line R may turn about it by any angle, which moves none of them.
class RigidFit {
public:
  /// @param from  where x counts from: that of points which several processes have is to be of one origin
  explicit RigidFit(const Vec3& from = Vec3::Zero()) : from_(from) {}

  /// @param weight  > 0
  /// @param rest    x, not far from the origin beside the size of the body
  /// @param u       y - x
  void add(double weight, const Vec3& rest, const Vec3& u);
  std::span<double> sums() { return sums_; }  ///< over the points: those of several processes may be added up
  /// Once all points are added.
  void solve();
  Eigen::Isometry3d motion() const;
  /// What a displacement is beside the rigid motion: x + u - (R x + t).
  Vec3 deformation(const Vec3& rest, const Vec3& u) const {
    const Vec3 x = from_ + rest;
    return x + u - (rotation_ * x + shift_);
  }

private:
  Vec3 from_;
  std::array<double, 25> sums_{};  ///< of w, w x, w u, w x x^T, w u x^T
  Mat3 rotation_ = Mat3::Identity();
  Vec3 shift_ = Vec3::Zero();
};

}  // namespace hexsolver
