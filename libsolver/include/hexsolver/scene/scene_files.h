// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexsolver/scene/scene.h"

namespace hexsolver {

/// Likewise a scene that came through a pipe.
/// @param folder  that the names in it are relative to
Scene read_scene(const std::filesystem::path& path, const std::string& display_name,
                 const std::vector<std::string>& settings, const std::filesystem::path& folder);

/// Files that a scene names: markups, and the result that a motion starts from. Each once.
std::vector<std::filesystem::path> files_of(const Scene& scene);

}  // namespace hexsolver
