// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "hexmesh/geometry/triangle_surface.h"

namespace hexmesh {

/// Surfaces for the [[match]] and the [[contact]] of a scene, as hexsolve reads them without other libraries; see
/// FORMATS.md.
/// @throws Error{output}
void write_surface_target(const TriangleSurface& surface, const std::filesystem::path& path);

/// @throws Error{input} naming the file and what is wrong
TriangleSurface read_surface_target(const std::filesystem::path& path);

}  // namespace hexmesh
