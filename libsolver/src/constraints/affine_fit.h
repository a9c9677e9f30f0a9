// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/QR>
#include <vector>

#include "constraints/constraints.h"

namespace hexsolver {

/// The affine functions a + b . x nearest to values given at some points; along directions in which the points do not
/// differ they are constant. Translations and rotations are affine.
class AffineFit {
public:
  AffineFit(const Mesh& mesh, const std::vector<ConstraintPoint>& points, const std::vector<std::size_t>& members) {
    for (const std::size_t m : members)
      center_ += mesh.rest_position(points[m].cell, points[m].weights) / static_cast<double>(members.size());
    Eigen::MatrixXd rows(static_cast<Eigen::Index>(members.size()), 4);
    for (std::size_t n = 0; n < members.size(); ++n)
      rows.row(n) << 1, (mesh.rest_position(points[members[n]].cell, points[members[n]].weights) - center_).transpose();
    fit_.setThreshold(1e-9);
    fit_.compute(rows);
  }

  using Coefficients = Eigen::Vector4d;
  Coefficients of(const Eigen::VectorXd& values) const { return fit_.solve(values); }
  double at(const Vec3& x, const Coefficients& c) const { return c[0] + c.tail<3>().dot(x - center_); }

private:
  Vec3 center_ = Vec3::Zero();
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> fit_;
};

/// The value of each of some points along an axis.
inline Eigen::VectorXd prescribed(const std::vector<ConstraintPoint>& points, const std::vector<std::size_t>& members,
                                  std::size_t axis) {
  Eigen::VectorXd values(members.size());
  for (std::size_t n = 0; n < members.size(); ++n) values[n] = points[members[n]].value[axis];
  return values;
}

}  // namespace hexsolver
