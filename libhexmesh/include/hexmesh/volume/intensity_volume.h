// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hexmesh/core/grid.h"

namespace hexmesh {

/// Grey values on a grid, e.g. CT in Hounsfield units.
struct IntensityVolume {
  Grid grid;
  std::vector<float> values;  ///< shape (grid.num_voxels()), i fastest
};

/// The grey value at a position [mm]: trilinear between voxel centres, constant beyond the outermost ones, NaN outside
/// the volume. Within a thousandth of a voxel of a centre it is that voxel's own.
double value_at(const IntensityVolume& volume, const Vec3& position);

/// The same volume with axes permuted and flipped to be right-handed and nearest to L, P, S, as label volumes are.
IntensityVolume reorient_to_lps(IntensityVolume volume);

}  // namespace hexmesh
