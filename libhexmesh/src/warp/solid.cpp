// SPDX-License-Identifier: Apache-2.0
#include "solid.h"

#include <algorithm>
#include <limits>

namespace hexmesh {

Vec3 embedded(const Result& result, const Embedding& e) {
  const NodeWeights weights = shape_functions(e.local);
  Vec3 u = Vec3::Zero();
  for (int a = 0; a < num_cell_nodes; ++a) u += weights[a] * displacement_of(result, result.cell_nodes[e.cell][a]);
  return u;
}

double Solid::distance(const Vec3& index, double reach) const {
  const Index3 home = nearest_voxel(index);
  if (at(home)) return 0;
  const int shell = static_cast<int>(std::ceil(reach));
  double least = std::numeric_limits<double>::infinity();
  for (int k = -shell; k <= shell; ++k)
    for (int j = -shell; j <= shell; ++j)
      for (int i = -shell; i <= shell; ++i) {
        const Index3 v = {home[0] + i, home[1] + j, home[2] + k};
        if (!at(v)) continue;
        const Vec3 outside = ((index - Vec3(v[0], v[1], v[2])).cwiseAbs().array() - 0.5).max(0);
        least = std::min(least, outside.maxCoeff());
      }
  return least <= reach ? least : std::numeric_limits<double>::infinity();
}

bool Solid::is_interior(const Index3& cell) const {
  for (int n = 0; n < 27; ++n) {
    Index3 voxel;
    const std::array<int, 3> step = {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
    for (std::size_t d = 0; d < 3; ++d) voxel[d] = (cell[d] + step[d]) * result_.voxels_per_cell[d];
    if (locator_.cell_of_voxel(voxel) < 0) return false;
  }
  return true;
}

}  // namespace hexmesh
