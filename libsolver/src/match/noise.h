// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/geometry/triangle_surface.h"

namespace hexsolver {

/// How far the points of a surface scatter across it: the standard deviation [mm] of independent errors that would give
/// as large second differences between neighbours. What is smooth has next to none, curved or not.
double noise_of(const hexmesh::TriangleSurface& surface);

}  // namespace hexsolver
