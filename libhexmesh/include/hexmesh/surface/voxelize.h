// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "hexmesh/core/grid.h"
#include "hexmesh/geometry/triangle_surface.h"

namespace hexmesh {

/// Cubic voxels along the patient axes around all shapes, centred on them, with two voxels of margin.
/// @param room  more than that [mm]
/// @throws Error{usage} where that takes more than 2^31 voxels
Grid grid_around(const std::vector<Shape>& shapes, double spacing, double room = 0);

/// What became of a shape.
struct Voxelization {
  std::vector<std::size_t> voxels;  ///< offsets, ascending
  std::size_t closed_parts = 0;     ///< filled: centres around which the surface winds
  std::size_t open_parts = 0;       ///< sheets: a shell of the voxels that they cross
  std::size_t mended_parts = 0;  ///< of the closed ones: whose triangles face both ways; filled by counting crossings
  double enclosed_ml = 0;        ///< by the closed parts that face one way [mL]
  std::vector<std::pair<std::size_t, std::size_t>> nearly_closed;  ///< of the open parts: open edges and all, where few
};

/// Voxels of a grid that a shape fills, part by part: what hangs together by shared points is a part.
///
/// A closed part fills the voxels whose centres it winds around (winding number not 0, so that parts may cross
/// themselves and each other, and a part inside another facing inwards is a hole); an open one gives the voxels it
/// passes, connected through faces; so do lines.
/// @param thickness  of open parts and lines [mm]: voxels whose centres are within half of it instead; 0: none
Voxelization voxelize(const Shape& shape, const Grid& grid, double thickness = 0);

}  // namespace hexmesh
