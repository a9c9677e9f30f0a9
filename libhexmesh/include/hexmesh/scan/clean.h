// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/volume/label_volume.h"

namespace hexmesh {

/// Voxels that a step took from and gave to each segment, in the order of `volume.segments`.
struct Cleaning {
  std::vector<std::size_t> removed, added;
};

// Parts hang together through voxel faces. Each step goes through the segments one by one; voxels of other segments are
// never overwritten.

/// Keep, of each segment, only the largest part.
Cleaning keep_largest_component(LabelVolume& volume);

/// Keep the part that holds a place [mm], and nothing of other segments.
/// @returns false, and nothing is changed, where no segment is there
bool keep_component_at(LabelVolume& volume, const Vec3& place);

/// Remove parts smaller than `volume_ml` [mL].
Cleaning remove_specks(LabelVolume& volume, double volume_ml);

/// Give to each segment the background that it encloses.
Cleaning fill_cavities(LabelVolume& volume);

/// Erode, then dilate by a ball of that radius [mm], measured between voxel centres: cuts thin bridges and spikes.
Cleaning open_segments(LabelVolume& volume, double radius);

/// Dilate, then erode: fills thin gaps of background.
Cleaning close_segments(LabelVolume& volume, double radius);

}  // namespace hexmesh
