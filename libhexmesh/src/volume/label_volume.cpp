// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/volume/label_volume.h"

#include <algorithm>
#include <cmath>

#include "../core/text.h"
#include "reorient.h"

namespace hexmesh {

std::uint16_t label_at(const Grid& grid, std::span<const std::uint16_t> labels, const Vec3& position) {
  const Vec3 index = grid.continuous_index(position);
  if (!grid.covers(index)) return 0;
  Index3 voxel;
  for (std::size_t d = 0; d < 3; ++d) {
    const long nearest = std::lround(index[d]);
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

}  // namespace hexmesh
