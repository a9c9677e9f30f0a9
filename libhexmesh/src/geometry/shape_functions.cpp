// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/geometry/shape_functions.h"

namespace hexmesh {

NodeWeights shape_functions(const Vec3& s) {
  NodeWeights n;
  for (int a = 0; a < num_cell_nodes; ++a) {
    n[a] = 1;
    for (int d = 0; d < 3; ++d) n[a] *= corner_bit(a, d) ? s[d] : 1 - s[d];
  }
  return n;
}

Vec3 local_position(const NodeWeights& weights) {
  Vec3 s = Vec3::Zero();
  for (int a = 0; a < num_cell_nodes; ++a)
    for (int d = 0; d < 3; ++d) s[d] += weights[a] * corner_bit(a, d);
  return s;
}

NodeGradients shape_gradients(const Vec3& s) {
  NodeGradients g;
  for (int a = 0; a < num_cell_nodes; ++a)
    for (int k = 0; k < 3; ++k) {
      g(a, k) = corner_bit(a, k) ? 1 : -1;
      for (int d = 0; d < 3; ++d)
        if (d != k) g(a, k) *= corner_bit(a, d) ? s[d] : 1 - s[d];
    }
  return g;
}

CellVector linear_field(const Mat3& edges, const Mat3& gradient) {
  CellVector u;
  for (int a = 0; a < num_cell_nodes; ++a)
    u.segment<3>(3 * a) = gradient * edges * Vec3(corner_bit(a, 0), corner_bit(a, 1), corner_bit(a, 2));
  return u;
}

}  // namespace hexmesh
