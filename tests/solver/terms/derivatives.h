// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mesh/mesh.h"
#include "terms/potential.h"

/// Forces and Hessians of potentials beside differences, and their sums.
namespace testing_support {

using hexsolver::NodeVector;
using hexsolver::Potential;

inline NodeVector gradient_of(const Potential& potential, const NodeVector& u) {
  NodeVector g, magnitude;
  potential.gradient(u, g, magnitude);
  return g;
}

/// Of the energy along a direction, by central differences.
inline double measured_slope(const Potential& potential, const NodeVector& u, const NodeVector& direction,
                             double h = 1e-6) {
  return (potential.energy(u + h * direction) - potential.energy(u - h * direction)) / (2 * h);
}

/// Of the gradient along a direction, likewise.
inline NodeVector measured_product(const Potential& potential, const NodeVector& u, const NodeVector& direction,
                                   double h = 1e-6) {
  return (gradient_of(potential, u + h * direction) - gradient_of(potential, u - h * direction)) / (2 * h);
}

/// Of all forces -g on the nodes where these are displaced by u.
struct SumOfForces {
  hexsolver::Vec3 force = hexsolver::Vec3::Zero(), moment = force;
  double size = 0;  ///< sum of their lengths

  SumOfForces(const hexsolver::Mesh& mesh, const NodeVector& u, const NodeVector& gradient) {
    for (std::size_t n = 0; n < mesh.num_nodes(); ++n) {
      const auto at = 3 * static_cast<Eigen::Index>(n);
      const hexsolver::Vec3 of_node = -gradient.segment<3>(at);
      force += of_node;
      moment += (mesh.position(n) + u.segment<3>(at)).cross(of_node);
      size += of_node.norm();
    }
  }
};

}  // namespace testing_support
