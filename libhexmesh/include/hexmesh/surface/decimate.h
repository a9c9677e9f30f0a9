// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/geometry/triangle_surface.h"

namespace hexmesh {

/// Fewer triangles by edge collapse (Lindstrom, Turk, "Fast and memory efficient polygonal simplification", 1998),
/// which keeps the volume; no triangle turns over. All triangles must be of one segment.
/// @param num_triangles  wanted; a surface that has no more comes back as it is
TriangleSurface decimate(const TriangleSurface& surface, std::size_t num_triangles);

/// Pairs of triangles that cross each other.
std::size_t count_self_intersections(const TriangleSurface& surface);

}  // namespace hexmesh
