// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/volume/label_volume.h"

namespace hexmesh {

/// The labels on voxels of which whole numbers, powers of two, make cubes of exactly `cell_size`: along each axis the
/// voxel edge cell_size / 2^k that is nearest to the scan's (by ratio, so at most sqrt(2) off; never above cell_size).
/// A new voxel takes the label of the old one at its centre.
/// @param cell_size  [mm]
/// @throws Error{usage} if cell_size is not > 0 or the new volume would have more than 2^31 voxels
LabelVolume resample_for_cells(const LabelVolume& volume, double cell_size);

}  // namespace hexmesh
