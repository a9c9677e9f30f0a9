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

/// Where what is at a voxel of `grid` was: in the body by its exact field, around it by the warp's; nothing where the
/// warp folds so that the body would be seen a second time.
std::optional<Vec3> rest_of(const Result& result, const Solid& solid, const Grid& grid, std::size_t n,
                            const DisplacementField& exact, const DisplacementField& to_rest) {
  const Index3 v = grid.index(n);
  const Vec3 x = grid.center(v);
  if (const Vec3 step = exact.values[n].cast<double>(); !std::isnan(step[0])) return x + step;
  const Vec3 rest = x + to_rest.at(x);
  if (solid.at(nearest_voxel(result.voxels.continuous_index(rest)))) return std::nullopt;
  return rest;
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
  const DisplacementField exact = displacement_to_rest(result, grid);
  const Solid solid(result);
#pragma omp parallel for schedule(dynamic, 4096)
  for (std::size_t n = 0; n < out.values.size(); ++n) {
    const std::optional<Vec3> rest = rest_of(result, solid, grid, n, exact, to_rest);
    const double value = rest ? value_at(scan, *rest) : std::numeric_limits<double>::quiet_NaN();
    out.values[n] = std::isfinite(value) ? static_cast<float>(value) : lowest;
  }
  return out;
}

LabelVolume deformed_labels(const Result& result, const DisplacementField& to_rest, const Grid& grid) {
  expect_memory(grid.num_voxels() * sizeof(std::uint16_t), "the deformed segmentation");
  LabelVolume out{grid, std::vector<std::uint16_t>(grid.num_voxels()), {}};
  for (const LatticeSegment& s : result.segments) out.segments.push_back(s.segment);
  const DisplacementField exact = displacement_to_rest(result, grid);
  const Solid solid(result);
#pragma omp parallel for schedule(dynamic, 4096)
  for (std::size_t n = 0; n < out.labels.size(); ++n)
    if (const std::optional<Vec3> rest = rest_of(result, solid, grid, n, exact, to_rest))
      out.labels[n] = label_at(result.voxels, result.labels, *rest);
  return out;
}

}  // namespace hexmesh
