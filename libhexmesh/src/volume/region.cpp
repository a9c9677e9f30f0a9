// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/volume/region.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hexmesh/core/error.h"

namespace hexmesh {
namespace {

/// The box of indices of all voxels seen.
struct Bounds {
  Index3 low, high = {-1, -1, -1};
  explicit Bounds(const Grid& grid) : low(grid.extent()) {}
  void include(const Index3& v) {
    for (std::size_t d = 0; d < 3; ++d) {
      low[d] = std::min(low[d], v[d]);
      high[d] = std::max(high[d], v[d]);
    }
  }
  bool empty() const { return high[0] < 0; }
};

/// The voxels from `low` to `high`, both included, as a volume of their own.
LabelVolume crop(const LabelVolume& volume, const Index3& low, const Index3& high) {
  const Grid grid({high[0] - low[0] + 1, high[1] - low[1] + 1, high[2] - low[2] + 1}, volume.grid.spacing(),
                  volume.grid.center(low), volume.grid.direction());
  LabelVolume out{grid, {}, volume.segments};
  out.labels.reserve(grid.num_voxels());
  for (std::int32_t k = low[2]; k <= high[2]; ++k)
    for (std::int32_t j = low[1]; j <= high[1]; ++j) {
      const auto row = volume.labels.begin() + static_cast<std::ptrdiff_t>(volume.grid.offset({low[0], j, k}));
      out.labels.insert(out.labels.end(), row, row + grid.extent()[0]);
    }
  return out;
}

}  // namespace

LabelVolume crop_to_box(const LabelVolume& volume, const Box& box) {
  LabelVolume inside = volume;
  Bounds bounds(volume.grid);
  for (std::size_t n = 0; n < inside.labels.size(); ++n) {
    const Index3 v = volume.grid.index(n);
    if (box.contains(volume.grid.center(v)))
      bounds.include(v);
    else
      inside.labels[n] = 0;
  }
  if (bounds.empty())
    throw Error(
        ErrorKind::geometry,
        fmt::format("the zone of interest around ({:.1f}, {:.1f}, {:.1f}) mm holds no voxel of the scan, expected "
                    "a box inside it (LPS, mm)",
                    box.center[0], box.center[1], box.center[2]));
  return crop(inside, bounds.low, bounds.high);
}

LabelVolume crop_to_segments(const LabelVolume& volume, double margin) {
  Bounds bounds(volume.grid);
  for (std::size_t n = 0; n < volume.labels.size(); ++n)
    if (volume.labels[n] != 0) bounds.include(volume.grid.index(n));
  if (bounds.empty())
    throw Error(ErrorKind::geometry, "no voxel has a label, expected segments to keep a margin around");
  for (std::size_t d = 0; d < 3; ++d) {
    const double room = margin / volume.grid.spacing()[d];
    const auto voxels = static_cast<std::int32_t>(std::min(std::ceil(room - 1e-9), 65536.0));
    bounds.low[d] = std::max(bounds.low[d] - voxels, 0);
    bounds.high[d] = std::min(bounds.high[d] + voxels, volume.grid.extent()[d] - 1);
  }
  return crop(volume, bounds.low, bounds.high);
}

}  // namespace hexmesh
