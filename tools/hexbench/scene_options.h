// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "cli/run_files.h"
#include "hexsolver/scene/scene.h"

namespace hextools {

/// What is measured on, and how: of all subcommands that take a lattice file, most with a scene.
struct SceneOptions {
  std::string lattice, scene, output = "-";
  int repeats = 5, level = 0;
};

void add_lattice(CLI::App& app, SceneOptions& o);
void add_repeats(CLI::App& app, int& repeats);
void add_report(CLI::App& app, std::string& output);

/// All of them.
std::shared_ptr<SceneOptions> add_scene_options(CLI::App& app);

/// A scene on a level of a lattice.
struct SceneOnLevel {
  hexmesh::Lattice lattice;  ///< with the materials of the scene
  hexsolver::Scene scene;
  int level = 0;
};

/// @param asks_accuracy  whether the scene is solved to accuracies too, which other cells than a level's have
/// @throws Error{usage} if the scene is a motion and none is wanted, or the other way round; as the readers
SceneOnLevel read_scene_on_level(const SceneOptions& o, bool wants_motion, RunFiles& files, bool asks_accuracy = false);

/// A subcommand that measures a scene on a level and writes what it found.
/// @param measure  with the options and the console
using MeasureScene = std::function<nlohmann::json(const SceneOnLevel&, const SceneOptions&, const Console&)>;
std::function<int()> run_on_scene(const std::shared_ptr<SceneOptions>& o, bool wants_motion,
                                  const MeasureScene& measure, const CommonOptions& common, const Console& console);

}  // namespace hextools
