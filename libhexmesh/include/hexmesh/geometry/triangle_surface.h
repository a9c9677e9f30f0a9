// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "hexmesh/core/grid.h"

namespace hexmesh {

/// Triangles embedded in a lattice; picture surfaces, not the mechanics.
struct TriangleSurface {
  std::vector<Vec3> points;                            ///< rest positions [mm], LPS
  std::vector<std::array<std::int32_t, 3>> triangles;  ///< point numbers, counter-clockwise seen from outside
  std::vector<std::uint16_t> segment;                  ///< label of each triangle
};

/// Surfaces and lines that stand for one structure.
struct Shape {
  TriangleSurface surface;
  std::vector<std::vector<Vec3>> lines;  ///< polylines [mm], LPS
};

/// The triangles of one segment with the points they use.
TriangleSurface of_segment(const TriangleSurface& surface, std::uint16_t label);

/// Add one triangle of another surface, with its label where it has one and those of its points that are not there yet.
/// @param number  of each point of `from` in `to`, -1 where it is not there yet; kept up to date
void add_triangle(TriangleSurface& to, const TriangleSurface& from, std::size_t triangle,
                  std::vector<std::int32_t>& number);

/// Enclosed volume [mm^3], positive for triangles that are counter-clockwise seen from outside.
double enclosed_volume(const TriangleSurface& surface);

/// Edges with no triangle, or none of the opposite sense, on the other side; 0 for a closed surface.
std::size_t count_open_edges(const TriangleSurface& surface);

/// Edges, and those with an odd number of triangles: none where the surface closes, whichever way these face.
struct Edges {
  std::size_t all = 0, open = 0;
};
Edges edges_of(const TriangleSurface& surface);

/// Of each point the lowest one of its piece: what hangs together by triangles.
std::vector<std::int32_t> pieces_of(const TriangleSurface& surface);

/// Points that lie in one place become one; triangles without area go, and those that are there already. No labels.
TriangleSurface merged(const TriangleSurface& surface);

/// Add another surface's triangles.
void append(TriangleSurface& to, const TriangleSurface& surface);

}  // namespace hexmesh
