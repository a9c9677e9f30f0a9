// SPDX-License-Identifier: Apache-2.0
#include "scene_options.h"

#include <fmt/format.h>

#include "cli/json_text.h"
#include "cli/scene_input.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/lattice_file.h"
#include "hexsolver/equilibrium/equilibrium.h"

namespace hextools {

void add_lattice(CLI::App& app, SceneOptions& o) {
  app.add_option("lattice", o.lattice, "Lattice file; - is standard input")->required();
}

void add_repeats(CLI::App& app, int& repeats) {
  app.add_option("--repeats", repeats, "Runs of which the median counts")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
}

void add_report(CLI::App& app, std::string& output) {
  app.add_option("-o,--output", output, "JSON (paper: Markdown); - is standard output")->capture_default_str();
}

std::shared_ptr<SceneOptions> add_scene_options(CLI::App& app) {
  auto o = std::make_shared<SceneOptions>();
  add_lattice(app, *o);
  add_repeats(app, o->repeats);
  app.add_option("scene", o->scene, "Scene file (TOML)")->required();
  app.add_option("--level", o->level, "Which level; 0 = voxels")->check(CLI::Range(0, 30))->capture_default_str();
  add_report(app, o->output);
  return o;
}

SceneOnLevel read_scene_on_level(const SceneOptions& o, bool wants_motion, RunFiles& files, bool asks_accuracy) {
  const Input& file = files.input(o.lattice);
  hexsolver::Scene scene = read_scene(files.input(o.scene, Content::text), files);
  scene.level = o.level;
  hexsolver::Scene to_read_for = scene;
  if (asks_accuracy) to_read_for.accuracy = 1;
  hexmesh::Lattice lattice = hexsolver::read_lattice_for(to_read_for, file.path(), {{}, true});
  const int level = hexsolver::finest_level(scene, lattice);
  if (wants_motion != scene.dynamics.has_value())
    throw hexmesh::Error(hexmesh::ErrorKind::usage,
                         fmt::format("the scene is {}, expected {}", scene.dynamics ? "a motion" : "no motion",
                                     wants_motion ? "one" : "an equilibrium"));
  return {std::move(lattice), std::move(scene), level};
}

std::function<int()> run_on_scene(const std::shared_ptr<SceneOptions>& o, bool wants_motion,
                                  const MeasureScene& measure, const CommonOptions& common, const Console& console) {
  return [o, wants_motion, measure, &common, &console] {
    RunFiles files(common);
    const SceneOnLevel scene = read_scene_on_level(*o, wants_motion, files);
    Output& output = files.output(o->output, Content::text);
    output.write(json_text(measure(scene, *o, console)));
    files.commit();
    return 0;
  };
}

}  // namespace hextools
