// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/volume/intensity_volume.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "hexmesh/geometry/shape_functions.h"
#include "reorient.h"

namespace hexmesh {

double value_at(const IntensityVolume& volume, const Vec3& position) {
  constexpr double at_center = 1e-3;
  const Grid& grid = volume.grid;
  const Vec3 index = grid.continuous_index(position);
  if (!grid.covers(index)) return std::numeric_limits<double>::quiet_NaN();
  Index3 base;
  Vec3 s;
  for (std::size_t d = 0; d < 3; ++d) {
    const double i = index[d];
    const double nearest = std::round(i);
    const double clamped = std::clamp(std::abs(i - nearest) < at_center ? nearest : i, 0.0, grid.extent()[d] - 1.0);
    base[d] = std::min(static_cast<std::int32_t>(clamped), std::max(grid.extent()[d] - 2, 0));
    s[d] = clamped - base[d];
  }
  const NodeWeights weights = shape_functions(s);
  double value = 0;
  for (int a = 0; a < num_cell_nodes; ++a) {
    if (weights[a] == 0) continue;
    Index3 v = base;
    for (std::size_t d = 0; d < 3; ++d)
      v[d] = std::min(v[d] + corner_bit(a, static_cast<int>(d)), grid.extent()[d] - 1);
    value += weights[a] * static_cast<double>(volume.values[grid.offset(v)]);
  }
  return value;
}

IntensityVolume reorient_to_lps(IntensityVolume volume) {
  const Reorientation turn(volume.grid);
  return {turn.grid(), turn.apply(std::move(volume.values))};
}

}  // namespace hexmesh
