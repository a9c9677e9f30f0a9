// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "hexsolver/scene/scene.h"

namespace hextools {

/// A line for each file that a solution reads, with its checksum; no scene file where the name is empty.
std::vector<std::string> files_read(const std::string& lattice, const std::filesystem::path& lattice_file,
                                    const std::string& scene_name, const std::filesystem::path& scene_file,
                                    const hexsolver::Scene& scene);

/// This run's entry of the history: the command line and the files read.
/// @param lattice, scene_name  as the user named them
std::string solve_history(const std::string& lattice, const std::filesystem::path& lattice_file,
                          const std::string& scene_name, const std::filesystem::path& scene_file,
                          const hexsolver::Scene& scene);

}  // namespace hextools
