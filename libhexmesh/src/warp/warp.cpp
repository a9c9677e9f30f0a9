// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/warp/warp.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "hexmesh/core/error.h"
#include "hexmesh/warp/bounds.h"
#include "solid.h"

namespace hexmesh {
namespace {

constexpr double margin_in_displacements = 1.5;
constexpr double least_margin = 10;  // [mm]
constexpr std::size_t most_samples = 24000000;
constexpr double most_voxels = 2e9;

/// The grid continued by whole voxels to hold the bounds.
Grid continued(const Grid& grid, const Bounds& bounds) {
  Vec3 low = Vec3::Zero(), high = grid.corner(7);
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 p;
    for (int d = 0; d < 3; ++d) p[d] = corner_bit(corner, d) == 1 ? bounds.high[d] : bounds.low[d];
    const Vec3 index = grid.continuous_index(p);
    low = low.cwiseMin(index);
    high = high.cwiseMax(index);
  }
  low = low.array().floor();
  const Vec3 count = (high - low).array().ceil() + 1;
  if (!(count.prod() < most_voxels))
    throw Error(ErrorKind::geometry, fmt::format("a grid around the body at rest and deformed takes {:.3g} voxels, "
                                                 "expected fewer: the body moved too far for its voxels",
                                                 count.prod()));
  return Grid(
      {static_cast<std::int32_t>(count[0]), static_cast<std::int32_t>(count[1]), static_cast<std::int32_t>(count[2])},
      grid.spacing(), grid.position(low), grid.direction());
}

}  // namespace

Grid fitted_grid(const Result& result) { return continued(result.voxels, bounds_of(result)); }

Grid warp_grid(const Result& result) {
  double largest = 0;
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for_each_voxel(result, [&](const Vec3& rest, const Vec3& u) {
    largest = std::max(largest, u.norm());
    low = low.cwiseMin(rest);
    high = high.cwiseMax(rest);
  });
  const double size = (high - low).maxCoeff();
  const double margin = std::max(least_margin, std::min(margin_in_displacements * largest, size / 2));
  Bounds b = bounds_of(result);
  b.low.array() -= margin;
  b.high.array() += margin;
  Grid grid = continued(result.voxels, b);
  while (grid.num_voxels() > most_samples) {
    Eigen::Index finest = 0;
    grid.spacing().minCoeff(&finest);
    Index3 extent = grid.extent();
    Vec3 spacing = grid.spacing();
    extent[finest] = (extent[finest] + 2) / 2;
    spacing[finest] *= 2;
    grid = Grid(extent, spacing, grid.origin(), grid.direction());
  }
  return grid;
}

Warp make_warp(const Result& result) {
  const Grid grid = warp_grid(result);
  Warp warp{displacement_to_rest(result, grid, 1), displacement_from_rest(result, grid, 1)};
  continue_to_border(warp.to_rest);
  continue_to_border(warp.from_rest);
  return warp;
}

WarpCheck check_warp(const Result& result, const Warp& warp) {
  const Solid solid(result);
  const Index3& extent = result.voxels.extent();
  std::vector<WarpCheck> of_layers(as_size(extent[2]));  // summed in their order, whatever the number of threads
#pragma omp parallel for schedule(dynamic, 1)
  for (std::int32_t k = 0; k < extent[2]; ++k) {
    WarpCheck& check = of_layers[as_size(k)];
    for (std::int32_t j = 0; j < extent[1]; ++j)
      for (std::int32_t i = 0; i < extent[0]; ++i) {
        if (!solid.at({i, j, k})) continue;
        const Vec3 rest = result.voxels.center({i, j, k});
        const Vec3 moved = rest + warp.from_rest.at(rest);
        const Vec3 back = moved + warp.to_rest.at(moved);
        const double miss =
            (result.voxels.continuous_index(back) - result.voxels.continuous_index(rest)).cwiseAbs().maxCoeff();
        ++check.voxels;
        check.over_a_tenth += miss > 0.1;
        check.mean += miss;
        check.largest = std::max(check.largest, miss);
      }
  }
  WarpCheck check;
  for (const WarpCheck& layer : of_layers) {
    check.voxels += layer.voxels;
    check.over_a_tenth += layer.over_a_tenth;
    check.mean += layer.mean;
    check.largest = std::max(check.largest, layer.largest);
  }
  check.mean /= static_cast<double>(std::max<std::size_t>(check.voxels, 1));

  const Grid& grid = warp.to_rest.grid;
  std::atomic<std::size_t> ghosts = 0;
  for_each_slab_to_rest(result, grid, 0, [&](const FieldSlab& slab) {
    std::size_t found = 0;
    for_each_sample(slab, [&](const Index3& v, const Eigen::Vector3f& exact) {
      if (!std::isnan(exact[0])) return;
      const Vec3 rest = grid.center(v) + warp.to_rest.values[grid.offset(v)].cast<double>();
      found += solid.at(nearest_voxel(result.voxels.continuous_index(rest)));
    });
    ghosts += found;
  });
  check.ghost_ml = static_cast<double>(ghosts) * grid.voxel_volume() / 1000;
  return check;
}

namespace {

double body_ml(const Result& result) {
  double voxels = 0;
  for (const LatticeSegment& s : result.segments)
    if (s.material) voxels += static_cast<double>(s.num_voxels);
  return voxels * result.voxels.voxel_volume() / 1000;
}

}  // namespace

WarpNotices notices_of(const Result& result, const Warp& warp, const WarpCheck& check) {
  WarpNotices out;
  const std::string text = fmt::format(
      "the transforms undo each other in the body to {:.2g} voxels on average, {:.2g} at worst; {} of {} voxels are "
      "off by more than 0.1",
      check.mean, check.largest, check.over_a_tenth, check.voxels);
  const double share =
      static_cast<double>(check.over_a_tenth) / static_cast<double>(std::max<std::size_t>(check.voxels, 1));
  const Vec3& samples = warp.to_rest.grid.spacing();
  if (share > 0.1)
    throw Error(ErrorKind::geometry,
                fmt::format("{}: a field of samples every {:.3g} x {:.3g} x {:.3g} mm cannot hold this deformation, "
                            "expected less motion or a smaller body",
                            text, samples[0], samples[1], samples[2]));
  if (share > 1e-3)
    out.warnings.push_back(text + ": the body is folded or nearly flat there");
  else
    out.note = text;
  if (check.ghost_ml > 0.01 * body_ml(result))
    out.warnings.push_back(
        fmt::format("{:.3g} mL around the body are led into it by the transform, because it moves farther than it is "
                    "thick: filters show the body there a second time (--to and --segmentation do not)",
                    check.ghost_ml));
  return out;
}

std::string warning_of_grid(const Result& result, const Grid& grid) {
  const Bounds b = bounds_of(result);
  const Vec3 last = grid.corner(7), middle = grid.continuous_index((b.low + b.high) / 2);
  const double reach = (b.high - b.low).norm() / 2;
  for (int d = 0; d < 3; ++d)
    if ((middle[d] - last[d]) * grid.spacing()[d] > reach || -middle[d] * grid.spacing()[d] > reach)
      throw Error(ErrorKind::input, "the grid to write on holds no part of the body, expected one around it");
  const auto holds = [&](const Vec3& p) { return grid.covers(grid.continuous_index(p)); };
  std::size_t outside = 0;
  for (std::size_t n = 0; n < result.surface_displacement.size(); ++n) {
    const Vec3& p = result.surface.points[n];
    outside += holds(p) && !holds(p + result.surface_displacement[n]);
  }
  if (outside == 0) return "";
  return fmt::format(
      "{} of {} surface points of the body move out of the volume that is written: a grid that is fitted holds all of "
      "it (--grid fitted)",
      outside, result.surface.points.size());
}

}  // namespace hexmesh
