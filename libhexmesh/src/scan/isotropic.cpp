// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/scan/isotropic.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "hexmesh/core/error.h"
#include "hexmesh/volume/intensity_volume.h"
#include "segment_region.h"

namespace hexmesh {
namespace {

/// The voxels of an edge that fill the box of a grid, both with one middle.
Grid cubic(const Grid& grid, double edge) {
  constexpr double most_voxels = 0x1p31, rounding = 1e-6;
  Vec3 counts;
  for (int d = 0; d < 3; ++d)
    counts[d] =
        std::max(1.0, std::ceil(grid.extent()[static_cast<std::size_t>(d)] * grid.spacing()[d] / edge - rounding));
  if (!(counts.prod() <= most_voxels))
    throw Error(ErrorKind::usage, fmt::format("voxels of {:g} mm are {:.3g} in all, expected at most {:.3g}", edge,
                                              counts.prod(), most_voxels));
  Vec3 middle;
  for (int d = 0; d < 3; ++d) middle[d] = (grid.extent()[static_cast<std::size_t>(d)] - 1) / 2.0;
  const Vec3 origin = grid.position(middle) - grid.direction() * ((counts - Vec3::Ones()) / 2 * edge);
  return Grid({static_cast<int>(counts[0]), static_cast<int>(counts[1]), static_cast<int>(counts[2])},
              Vec3::Constant(edge), origin, grid.direction());
}

/// How deep places are inside a segment, outside negative [mm]; with room for what is around it.
IntensityVolume depth_of(const LabelVolume& volume, std::uint16_t label) {
  const Region region = region_of(volume, label, {2, 2, 2});
  if (!region.mask) return {volume.grid, {}};
  std::uint8_t* mask = region.mask->GetBufferPointer();
  for_each_voxel(region, volume.grid, [&](std::size_t n, std::size_t v) { mask[n] = volume.labels[v] == label; });
  const Vec3 low(region.low[0], region.low[1], region.low[2]);
  IntensityVolume out{Grid(region.extent, volume.grid.spacing(), volume.grid.position(low), volume.grid.direction()),
                      {}};
  const auto outside = distances_to(region.mask);
  const std::size_t count = out.grid.num_voxels();
  for (std::size_t n = 0; n < count; ++n) mask[n] = mask[n] == 0;
  const auto inside = distances_to(region.mask);
  out.values.resize(count);
  for (std::size_t n = 0; n < count; ++n)
    out.values[n] = mask[n] == 0 ? inside->GetBufferPointer()[n] : -outside->GetBufferPointer()[n];
  return out;
}

/// A voxel that a segment may have, and how deep it is inside.
struct Claim {
  std::size_t voxel;
  float depth;
};

/// Voxels inside a segment and a little around that no other has yet.
std::vector<Claim> claims_of(const LabelVolume& volume, std::uint16_t label, const LabelVolume& on) {
  std::vector<Claim> out;
  const IntensityVolume depth = depth_of(volume, label);
  const double around = -2 * volume.grid.spacing().maxCoeff();
  const Vec3 low = on.grid.continuous_index(depth.grid.position(Vec3::Zero()));
  const Vec3 high = on.grid.continuous_index(depth.grid.position(depth.grid.corner(7)));
  Index3 first, last;
  for (std::size_t d = 0; d < 3; ++d) {
    const auto a = static_cast<Eigen::Index>(d);
    first[d] = static_cast<std::int32_t>(std::max(0.0, std::floor(low[a])));
    last[d] = static_cast<std::int32_t>(std::min(on.grid.extent()[d] - 1.0, std::ceil(high[a])));
  }
  for (std::int32_t k = first[2]; k <= last[2]; ++k)
    for (std::int32_t j = first[1]; j <= last[1]; ++j)
      for (std::int32_t i = first[0]; i <= last[0]; ++i) {
        const std::size_t n = on.grid.offset({i, j, k});
        if (on.labels[n] != 0) continue;
        const double d = value_at(depth, on.grid.position(Vec3(i, j, k)));
        if (d > around) out.push_back({n, static_cast<float>(d)});
      }
  return out;
}

}  // namespace

LabelVolume isotropic(const LabelVolume& volume, double edge) {
  LabelVolume out{cubic(volume.grid, edge), {}, volume.segments};
  out.labels.resize(out.grid.num_voxels());
  const std::vector<std::size_t> counts = count_voxels(volume);
  std::vector<std::size_t> order(counts.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return counts[a] < counts[b]; });
  for (const std::size_t s : order) {
    if (counts[s] == 0) continue;
    const std::uint16_t label = volume.segments[s].label;
    std::vector<Claim> claims = claims_of(volume, label, out);
    const double wanted = static_cast<double>(counts[s]) * volume.grid.voxel_volume() / out.grid.voxel_volume();
    const std::ptrdiff_t count = std::min<std::ptrdiff_t>(std::max(1L, std::lround(wanted)), std::ssize(claims));
    std::nth_element(claims.begin(), claims.begin() + count, claims.end(), [](const Claim& a, const Claim& b) {
      return a.depth != b.depth ? a.depth > b.depth : a.voxel < b.voxel;
    });
    for (std::ptrdiff_t n = 0; n < count; ++n) out.labels[claims[static_cast<std::size_t>(n)].voxel] = label;
  }
  return out;
}

}  // namespace hexmesh
