// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/lattice/lattice.h"

namespace hexmesh {

/// A smooth closed surface around every segment with material: flying edges (a marching cubes), then windowed-sinc
/// smoothing, which keeps the volume.
TriangleSurface extract_surface(const Lattice& lattice);

}  // namespace hexmesh
