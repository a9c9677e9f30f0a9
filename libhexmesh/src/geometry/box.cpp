// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/geometry/box.h"

namespace hexmesh {

Box box_between(const Vec3& low, const Vec3& high) {
  return {(2 * (high - low).cwiseInverse()).asDiagonal(), (low + high) / 2};
}

Box enlarged(const Box& box, double margin) {
  Box out = box;
  for (int d = 0; d < 3; ++d) out.to_box.row(d) /= 1 + margin * box.to_box.row(d).norm();
  return out;
}

}  // namespace hexmesh
