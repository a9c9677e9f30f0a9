// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/volume/resample.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hexmesh/core/error.h"
#include "hexmesh/core/memory.h"

namespace hexmesh {

LabelVolume resample_for_cells(const LabelVolume& volume, double cell_size) {
  if (!(std::isfinite(cell_size) && cell_size > 0))
    throw Error(ErrorKind::usage, fmt::format("cell size is {} mm, expected > 0", cell_size));
  constexpr double most_voxels = 2147483648.0;
  const Grid& old = volume.grid;
  Vec3 spacing, extent;
  for (int d = 0; d < 3; ++d) {
    const double halvings = std::max(0.0, std::round(std::log2(cell_size / old.spacing()[d])));
    spacing[d] = cell_size / std::exp2(halvings);
    extent[d] = std::ceil(old.extent()[d] * old.spacing()[d] / spacing[d]);
  }
  if (!(extent.prod() <= most_voxels && extent.maxCoeff() < 65536))
    throw Error(ErrorKind::usage, fmt::format("cells of {} mm need {:g} x {:g} x {:g} voxels, expected at most 2^31",
                                              cell_size, extent[0], extent[1], extent[2]));
  // Both volumes begin at the same corner.
  const Vec3 first = old.position(spacing.cwiseQuotient(old.spacing()) / 2 - Vec3::Constant(0.5));
  const Grid grid({static_cast<std::int32_t>(extent[0]), static_cast<std::int32_t>(extent[1]),
                   static_cast<std::int32_t>(extent[2])},
                  spacing, first, old.direction());
  expect_memory(grid.num_voxels() * sizeof(std::uint16_t), fmt::format("the labels at {} mm", cell_size));
  LabelVolume out{grid, std::vector<std::uint16_t>(grid.num_voxels()), volume.segments};
  std::array<std::vector<std::int32_t>, 3> from;  // old index by new index along each axis
  for (std::size_t d = 0; d < 3; ++d)
    for (std::int32_t i = 0; i < grid.extent()[d]; ++i) {
      const auto e = static_cast<Eigen::Index>(d);
      const auto old_index = static_cast<std::int32_t>((i + 0.5) * spacing[e] / old.spacing()[e]);
      from[d].push_back(old_index < old.extent()[d] ? old_index : -1);
    }
  std::size_t to = 0;
  for (const std::int32_t k : from[2])
    for (const std::int32_t j : from[1])
      for (const std::int32_t i : from[0]) {
        if (i >= 0 && j >= 0 && k >= 0) out.labels[to] = volume.labels[old.offset({i, j, k})];
        ++to;
      }
  return out;
}

}  // namespace hexmesh
