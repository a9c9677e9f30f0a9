// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace hexmesh {

/// Libraries believe what a surface file says of itself. This refuses counts that its bytes cannot hold and headers
/// that CGAL's and VTK's readers would stumble over.
/// @param ending  of the name, in small letters
/// @throws Error{input}
void check_surface_header(const std::filesystem::path& path, const std::string& ending);

}  // namespace hexmesh
