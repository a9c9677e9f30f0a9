// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/lattice/lattice.h"

namespace hexmesh {

/// A smooth closed surface around one segment: flying edges (a marching cubes), then windowed-sinc smoothing, which
/// keeps the volume.
/// @param label  of the segment
TriangleSurface extract_surface(const Lattice& lattice, std::uint16_t label);

}  // namespace hexmesh
