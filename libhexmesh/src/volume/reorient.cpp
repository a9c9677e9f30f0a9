// SPDX-License-Identifier: Apache-2.0
#include "reorient.h"

#include <Eigen/LU>
#include <algorithm>

namespace hexmesh {

Reorientation::Reorientation(const Grid& stored) : stored_(stored), grid_(stored) {
  // Of the 24 right-handed signed permutations of the stored axes, the one nearest to the LPS axes.
  double best_trace = -4;
  std::array<std::size_t, 3> order = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Mat3 turned;
      for (int d = 0; d < 3; ++d)
        turned.col(d) = (signs >> d & 1 ? -1.0 : 1.0) * stored.direction().col(static_cast<Eigen::Index>(order[d]));
      // The tiny bonus makes ties (exactly 45 degrees) independent of the stored order.
      const double trace = turned.trace() + 1e-9 * (turned(0, 1) + 2 * turned(1, 2));
      if (turned.determinant() > 0 && trace > best_trace) {
        best_trace = trace;
        from_ = order;
        flip_ = {(signs & 1) != 0, (signs & 2) != 0, (signs & 4) != 0};
      }
    }
  } while (std::next_permutation(order.begin(), order.end()));

  Index3 extent;
  Vec3 spacing, first = Vec3::Zero();
  Mat3 direction;
  unchanged_ = from_ == std::array<std::size_t, 3>{0, 1, 2} && flip_ == std::array<bool, 3>{};
  for (std::size_t d = 0; d < 3; ++d) {
    const auto to = static_cast<Eigen::Index>(d), from = static_cast<Eigen::Index>(from_[d]);
    extent[d] = stored.extent()[from_[d]];
    spacing[to] = stored.spacing()[from];
    direction.col(to) = (flip_[d] ? -1.0 : 1.0) * stored.direction().col(from);
    if (flip_[d]) first[from] = stored.extent()[from_[d]] - 1;
  }
  grid_ = Grid(extent, spacing, stored.position(first), direction);
}

}  // namespace hexmesh
