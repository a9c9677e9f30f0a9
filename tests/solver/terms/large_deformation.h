// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "support/bodies.h"

namespace testing_support {

/// A rotated, twisted and shaken state of a body, far from rest and without inverted cells.
inline hexsolver::NodeVector large_deformation(const hexsolver::Mesh& mesh, double roughness) {
  const Mat3 r = random_rotation(12);
  const hexsolver::NodeVector u = sample(mesh, [&](const Vec3& x) -> Vec3 {
    const Vec3 q = x - Vec3(15, -14, 36);
    const Vec3 stretched(1.3 * q[0] + 0.01 * q[1] * q[2], 0.8 * q[1], 0.9 * q[2] + 0.02 * q[0] * q[0]);
    return r * stretched - q;
  });
  return u + noise(mesh.num_dofs(), roughness, 21);
}

}  // namespace testing_support
