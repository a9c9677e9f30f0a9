// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Eigenvalues>
#include <vector>

#include "constraints/constraints.h"

namespace hexsolver {

/// The affine functions a + b . x nearest to values given at some points; along directions in which the points do not
/// differ they are constant. Translations and rotations are affine.
class AffineFit {
public:
  AffineFit(const Mesh& mesh, const std::vector<ConstraintPoint>& points, const std::vector<std::size_t>& members)
      : arms_(3, static_cast<Eigen::Index>(members.size())) {
    for (std::size_t n = 0; n < members.size(); ++n)
      arms_.col(n) = mesh.rest_position(points[members[n]].cell, points[members[n]].weights);
    center_ = arms_.rowwise().mean();
    arms_.colwise() -= center_;
    constexpr double no_difference = 1e-12;  // of squares of lengths
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(arms_ * arms_.transpose());
    const Vec3& squares = eigen.eigenvalues();
    for (int d = 0; d < 3; ++d)
      if (squares[d] > no_difference * squares[2])
        inverse_ += eigen.eigenvectors().col(d) * eigen.eigenvectors().col(d).transpose() / squares[d];
  }

  using Coefficients = Eigen::Vector4d;
  Coefficients of(const Eigen::VectorXd& values) const {
    Coefficients c;
    c << values.mean(), inverse_ * (arms_ * (values.array() - values.mean()).matrix());
    return c;
  }
  double at(const Vec3& x, const Coefficients& c) const { return c[0] + c.tail<3>().dot(x - center_); }

private:
  Eigen::Matrix3Xd arms_;  ///< of the points, from their center
  Vec3 center_ = Vec3::Zero();
  Mat3 inverse_ = Mat3::Zero();  ///< of the sum of arm armᵀ
};

/// The value of each of some points along an axis.
inline Eigen::VectorXd prescribed(const std::vector<ConstraintPoint>& points, const std::vector<std::size_t>& members,
                                  std::size_t axis) {
  Eigen::VectorXd values(members.size());
  for (std::size_t n = 0; n < members.size(); ++n) values[n] = points[members[n]].value[axis];
  return values;
}

}  // namespace hexsolver
