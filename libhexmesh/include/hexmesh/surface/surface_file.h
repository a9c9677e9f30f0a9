// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "hexmesh/geometry/triangle_surface.h"

namespace hexmesh {

/// Whether the name ends as one of a surface file does: .obj, .stl, .ply, .off, .vtp.
bool is_surface_name(const std::filesystem::path& path);

/// Read triangles (polygons are split) and polylines from OBJ, STL, PLY, OFF or VTP, told by the name's ending.
/// Coordinates are LPS in mm, unless one of the first lines says SPACE=RAS or the field data of a VTP do, as 3D Slicer
/// writes it.
/// @throws Error{input}, also where there is neither a triangle nor a line
Shape read_shape(const std::filesystem::path& path);

/// Its triangles.
/// @throws Error{input}, also where there are none
TriangleSurface read_surface(const std::filesystem::path& path);

/// Write OBJ, STL (binary), PLY (binary) or OFF, LPS in mm; segments are not kept.
/// @throws Error{output}
void write_surface(const TriangleSurface& surface, const std::filesystem::path& path);

}  // namespace hexmesh
