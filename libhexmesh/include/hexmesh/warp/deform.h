// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/volume/intensity_volume.h"
#include "hexmesh/volume/label_volume.h"
#include "hexmesh/warp/displacement_field.h"

namespace hexmesh {

/// The scan as it looks now: each voxel of `grid` takes the value at its rest position, in the body exactly, around it
/// by the warp; the scan's lowest outside the scan and where the body would be seen a second time.
IntensityVolume deform(const Result& result, const IntensityVolume& scan, const DisplacementField& to_rest,
                       const Grid& grid);

/// The segmentation of a result as it is now: each voxel of `grid` takes the label at its rest position, likewise.
LabelVolume deformed_labels(const Result& result, const DisplacementField& to_rest, const Grid& grid);

}  // namespace hexmesh
