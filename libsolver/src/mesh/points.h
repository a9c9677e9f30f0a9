// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hexsolver/core/vectors.h"

namespace hexsolver {

/// The vectors of a field, node by node.
inline std::vector<Vec3> to_points(const NodeVector& u) {
  std::vector<Vec3> out(static_cast<std::size_t>(u.size() / 3));
  for (std::size_t n = 0; n < out.size(); ++n) out[n] = u.segment<3>(3 * static_cast<Eigen::Index>(n));
  return out;
}

/// The field of vectors, node by node.
inline NodeVector to_field(const std::vector<Vec3>& points) {
  NodeVector out(3 * static_cast<Eigen::Index>(points.size()));
  for (std::size_t n = 0; n < points.size(); ++n) out.segment<3>(3 * static_cast<Eigen::Index>(n)) = points[n];
  return out;
}

}  // namespace hexsolver
