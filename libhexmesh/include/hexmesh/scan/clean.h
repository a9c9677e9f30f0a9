// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/scan/label_volume.h"

namespace hexmesh {

/// Keep, of each segment, only the largest part that hangs together through voxel faces.
/// @param removed  receives the voxels removed from each segment, in the order of `volume.segments`
LabelVolume keep_largest_component(LabelVolume volume, std::vector<std::size_t>& removed);

}  // namespace hexmesh
