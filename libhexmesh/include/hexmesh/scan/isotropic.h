// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/volume/label_volume.h"

namespace hexmesh {

/// The same segments on cubic voxels of an edge [mm] along the same axes.
///
/// Between voxel centres a segment's signed distance (to the nearest centre outside, and inside) is trilinear; the
/// voxels where it is largest are the segment, as many as have its volume, so that slices of another shape go over into
/// each other and thin parts are not lost. Small segments take theirs first.
/// Source: S. P. Raya, J. K. Udupa, "Shape-based interpolation of multidimensional objects", IEEE Trans. Med. Imaging 9
/// (1990); the volumes are ours.
/// @pre edge > 0
/// @throws Error{usage} where that takes more than 2^31 voxels
LabelVolume isotropic(const LabelVolume& volume, double edge);

}  // namespace hexmesh
