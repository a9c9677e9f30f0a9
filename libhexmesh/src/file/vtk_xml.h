// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace hexmesh {

/// VTK's XML readers believe what a file says of itself. This refuses what they would stumble over: elements and types
/// that volumes and surfaces do not need, and counts that the file has no bytes for.
/// @param kind  "ImageData" or "PolyData"
/// @throws Error{input}
void check_vtk_xml(const std::filesystem::path& path, const char* kind);

}  // namespace hexmesh
