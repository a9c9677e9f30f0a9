// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "hexmesh/surface/triangle_surface.h"

namespace hexmesh {

/// Read triangles (polygons are split) from OBJ, STL, PLY, OFF or VTP, told by the name's ending. Coordinates are LPS
/// in mm, unless one of the first lines says SPACE=RAS, as 3D Slicer writes it.
/// @throws Error{input}
TriangleSurface read_surface(const std::filesystem::path& path);

/// Write OBJ, STL (binary), PLY (binary) or OFF, LPS in mm; segments are not kept.
/// @throws Error{output}
void write_surface(const TriangleSurface& surface, const std::filesystem::path& path);

}  // namespace hexmesh
