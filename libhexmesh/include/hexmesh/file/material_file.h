// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "hexmesh/lattice/material_rule.h"

namespace hexmesh {

/// Read a materials file (TOML, see FORMATS.md): one table [material.SEGMENT] per segment.
/// @param display_name  of the file in messages
/// @throws Error{input} "file:line:column: key, value, what was expected"
std::map<std::string, MaterialChoice> read_materials(const std::filesystem::path& path,
                                                     const std::string& display_name);

/// Likewise a text in memory.
/// @param has_places  messages name lines of the text, which somebody wrote; else only `display_name`
std::map<std::string, MaterialChoice> parse_materials(std::string_view toml, const std::string& display_name,
                                                      bool has_places = true);

}  // namespace hexmesh
