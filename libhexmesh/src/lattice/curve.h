// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/lattice/surface_faces.h"

namespace hexmesh {

/// The order of faces in files: along a space-filling curve through the voxels, then of the sides.
bool along_curve(const ExposedFace& a, const ExposedFace& b);

}  // namespace hexmesh
