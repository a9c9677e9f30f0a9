// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "cli/run_files.h"
#include "hexsolver/scene/scene_files.h"

namespace hextools {

/// A scene; the files that it names are inputs of the run too.
/// @throws Error{input}, Error{usage} as hexsolver::read_scene
inline hexsolver::Scene read_scene(const Input& input, RunFiles& files, const std::vector<std::string>& settings = {}) {
  hexsolver::Scene scene = hexsolver::read_scene(input.path(), input.known_as(), settings, input.folder());
  for (const std::filesystem::path& file : hexsolver::files_of(scene)) files.input(file.string());
  return scene;
}

}  // namespace hextools
