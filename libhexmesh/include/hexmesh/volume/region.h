// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/geometry/box.h"
#include "hexmesh/volume/label_volume.h"

namespace hexmesh {

/// The zone of interest: voxels whose centres lie in the box, the others background, on the smallest grid that holds
/// them.
/// @throws Error{geometry} where no voxel lies in it
LabelVolume crop_to_box(const LabelVolume& volume, const Box& box);

/// The smallest grid with at least `margin` [mm] around all segments, or up to the volume's end.
/// @throws Error{geometry} where no voxel has a label
LabelVolume crop_to_segments(const LabelVolume& volume, double margin);

}  // namespace hexmesh
