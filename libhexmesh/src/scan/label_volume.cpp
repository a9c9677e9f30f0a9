// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/scan/label_volume.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../core/text.h"
#include "hexmesh/lattice/shape.h"
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
    const double i = index[static_cast<Eigen::Index>(d)];
    const double nearest = std::round(i);
    const double clamped = std::clamp(std::abs(i - nearest) < at_center ? nearest : i, 0.0, grid.extent()[d] - 1.0);
    base[d] = std::min(static_cast<std::int32_t>(clamped), std::max(grid.extent()[d] - 2, 0));
    s[static_cast<Eigen::Index>(d)] = clamped - base[d];
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

std::uint16_t label_at(const Grid& grid, std::span<const std::uint16_t> labels, const Vec3& position) {
  const Vec3 index = grid.continuous_index(position);
  if (!grid.covers(index)) return 0;
  Index3 voxel;
  for (std::size_t d = 0; d < 3; ++d) {
    const long nearest = std::lround(index[static_cast<Eigen::Index>(d)]);
    voxel[d] = static_cast<std::int32_t>(std::clamp(nearest, 0L, grid.extent()[d] - 1L));
  }
  return labels[grid.offset(voxel)];
}

std::vector<std::size_t> count_voxels(const LabelVolume& volume) {
  std::vector<std::size_t> by_label(65536);
  for (const std::uint16_t label : volume.labels) ++by_label[label];
  std::vector<std::size_t> counts;
  for (const Segment& s : volume.segments) counts.push_back(by_label[s.label]);
  return counts;
}

const Segment* find_segment(const std::vector<Segment>& segments, const std::string& name) {
  for (const Segment& s : segments)
    if (lower(s.name) == lower(name)) return &s;
  return nullptr;
}

LabelVolume reorient_to_lps(LabelVolume volume) {
  const Reorientation turn(volume.grid);
  return {turn.grid(), turn.apply(std::move(volume.labels)), std::move(volume.segments)};
}

IntensityVolume reorient_to_lps(IntensityVolume volume) {
  const Reorientation turn(volume.grid);
  return {turn.grid(), turn.apply(std::move(volume.values))};
}

}  // namespace hexmesh
