// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/warp/deform.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "hexmesh/core/memory.h"
#include "solid.h"

namespace hexmesh {
namespace {

/// Calls f(voxel's offset, where what is at it was) of each voxel of `grid`, several at once: in the body by its exact
/// field, around it by the warp's; nothing where the warp folds so that the body would be seen a second time.
template <class F>
void for_each_voxel_to_rest(const Result& result, const Grid& grid, const DisplacementField& to_rest, F&& f) {
  const Solid solid(result);
  for_each_slab_to_rest(result, grid, 0, [&](const FieldSlab& slab) {
    for_each_sample(slab, [&](const Index3& v, const Eigen::Vector3f& exact) {
      const Vec3 x = grid.center(v);
      const bool is_in_body = !std::isnan(exact[0]);
      const Vec3 rest = x + (is_in_body ? Vec3(exact.cast<double>()) : to_rest.at(x));
      const bool is_second = !is_in_body && solid.at(nearest_voxel(result.voxels.continuous_index(rest)));
      f(grid.offset(v), is_second ? std::nullopt : std::optional<Vec3>(rest));
    });
  });
}

}  // namespace

IntensityVolume deform(const Result& result, const IntensityVolume& scan, const DisplacementField& to_rest,
                       const Grid& grid) {
  expect_memory(grid.num_voxels() * sizeof(float), "the deformed scan");
  IntensityVolume out{grid, std::vector<float>(grid.num_voxels())};
  float lowest = std::numeric_limits<float>::infinity();
  for (const float value : scan.values)
    if (std::isfinite(value)) lowest = std::min(lowest, value);
  if (!std::isfinite(lowest)) lowest = 0;
  for_each_voxel_to_rest(result, grid, to_rest, [&](std::size_t n, const std::optional<Vec3>& rest) {
    const double value = rest ? value_at(scan, *rest) : std::numeric_limits<double>::quiet_NaN();
    out.values[n] = std::isfinite(value) ? static_cast<float>(value) : lowest;
  });
  return out;
}

LabelVolume deformed_labels(const Result& result, const DisplacementField& to_rest, const Grid& grid) {
  expect_memory(grid.num_voxels() * sizeof(std::uint16_t), "the deformed segmentation");
  LabelVolume out{grid, std::vector<std::uint16_t>(grid.num_voxels()), {}};
  for (const LatticeSegment& s : result.segments) out.segments.push_back(s.segment);
  for_each_voxel_to_rest(result, grid, to_rest, [&](std::size_t n, const std::optional<Vec3>& rest) {
    if (rest) out.labels[n] = label_at(result.voxels, result.labels, *rest);
  });
  return out;
}

}  // namespace hexmesh
