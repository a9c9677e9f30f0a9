// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "hexsolver/scene/scene.h"

namespace hexsolver {

/// Likewise a scene that came through a pipe.
/// @param folder  that the names in it are relative to
Scene read_scene(const std::filesystem::path& path, const std::string& display_name,
                 const std::vector<std::string>& settings, const std::filesystem::path& folder);

/// Likewise a scene in memory.
/// @param has_places  messages name lines of the text, which somebody wrote; else only `display_name`
Scene parse_scene(std::string_view toml, const std::string& display_name, const std::filesystem::path& folder,
                  bool has_places = true);

/// Files that a scene names: markups, and the result that a motion starts from. Each once.
std::vector<std::filesystem::path> files_of(const Scene& scene);

}  // namespace hexsolver
