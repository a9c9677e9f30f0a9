// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>

#include "build_options.h"
#include "hexmesh/lattice/assign.h"

namespace hextools {

/// The materials that --materials and --material give to segments.
/// @param file  of --materials, or nullptr
/// @param read  gets its checksum line
/// @throws Error{usage} naming the option; Error{input} as read_materials
std::map<std::string, hexmesh::MaterialChoice> material_choices(const BuildOptions& o, const Input* file,
                                                                std::vector<std::string>& read);

}  // namespace hextools
