// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "cli/interruption.h"
#include "cli/result_state.h"
#include "cli/run_files.h"
#include "cli/scene_input.h"
#include "hexmesh/core/error.h"
#include "hexview/display.h"
#include "hexview/options.h"
#include "hexview/script.h"
#include "hexview/session.h"

namespace {

using namespace hextools;
using hexmesh::Error;
using hexmesh::ErrorKind;

/// What makes a motion of an equilibrium, to be looked at rather than measured.
const std::vector<std::string> motion_of_equilibrium = {"solve.kind=dynamics", "dynamics.step_s=0.02",
                                                        "dynamics.duration_s=600", "dynamics.output_every=5",
                                                        "solve.tolerance=1e-3"};

/// The scene's arguments of hexsolve; those that make it a motion where it is none.
std::vector<std::string> solver_arguments(const ViewOptions& o, const hexsolver::Scene& scene,
                                          const CommonOptions& common) {
  std::vector<std::string> out = {o.input, o.scene, "--progress", "never"};
  std::vector<std::string> settings = o.settings;
  if (!scene.dynamics) settings.insert(settings.begin(), motion_of_equilibrium.begin(), motion_of_equilibrium.end());
  for (const std::string& s : settings) out.insert(out.end(), {"--set", s});
  if (!o.levels.empty()) out.insert(out.end(), {"--level", o.levels});
  if (common.threads > 0) out.insert(out.end(), {"--threads", fmt::format("{}", common.threads)});
  if (common.quiet) out.push_back("--quiet");
  return out;
}

std::deque<ScriptLine> script_of(const ViewOptions& o, RunFiles& files) {
  const Input* file = files.input_if_named(o.script, Content::text);
  return file ? read_script(file->path(), file->known_as()) : std::deque<ScriptLine>();
}

std::map<std::string, Output*> declare_pictures(const std::deque<ScriptLine>& script, RunFiles& files) {
  std::map<std::string, Output*> out;
  for (const ScriptLine& line : script)
    if (line.words[0] == "picture") {
      if (!line.words[1].ends_with(".png"))
        throw Error(ErrorKind::usage,
                    fmt::format("picture '{}' of the script, expected a name that ends in .png", line.words[1]));
      out[line.words[1]] = &files.output(line.words[1], Content::binary, ".png");
    }
  return out;
}

int finish(Session& session, RunFiles& files, const Console& console) {
  files.commit();
  if (session.num_pictures() > 1) console.note(session.summary());
  return session.signal() != 0 ? 128 + session.signal() : 0;
}

int look_at_result(const ViewOptions& o, const CommonOptions& common, const Console& console) {
  RunFiles files(common);
  const Input& input = files.input(o.input);
  const Input* scan_file = files.input_if_named(o.scan);
  std::deque<ScriptLine> script = script_of(o, files);
  const auto of_solver = std::find_if(script.begin(), script.end(), is_of_solver);
  if (of_solver != script.end())
    throw Error(ErrorKind::usage, fmt::format("{}:{}: '{}' goes with a scene, expected hexview LATTICE SCENE", o.script,
                                              of_solver->number, of_solver->words[0]));
  auto pictures = declare_pictures(script, files);
  expect_display();
  auto states = std::make_unique<StatesOfFile>(input.path());
  warn_of_state(states->now(), console);
  const std::optional<hexmesh::IntensityVolume> scan = read_scan_of(states->now(), scan_file, console);
  Session session(o, std::move(states), nullptr, nullptr, scan ? &*scan : nullptr, std::move(script),
                  std::move(pictures), console);
  session.run();
  return finish(session, files, console);
}

int move_body(const ViewOptions& o, const CommonOptions& common, const Console& console) {
  for (const std::string& name : {o.input, o.scene})
    if (name == "-")
      throw Error(ErrorKind::usage, "the lattice or the scene is -, expected files: hexsolve reads them too");
  RunFiles files(common);
  files.input(o.input);
  const hexsolver::Scene scene = read_scene(files.input(o.scene, Content::text), files, o.settings);
  const Input* scan_file = files.input_if_named(o.scan);
  std::deque<ScriptLine> script = script_of(o, files);
  auto pictures = declare_pictures(script, files);
  expect_display();

  std::vector<std::string> arguments = solver_arguments(o, scene, common);
  const hexmesh::ScratchFolder scratch(hexmesh::temporary_place());
  const std::string rest = scratch.path() / "rest.hexresult";
  std::vector<std::string> of_check = arguments;
  of_check.insert(of_check.end(), {"--check", "-o", rest, "--quiet"});
  if (const int code = run_hexsolve(of_check); code != 0) return code;
  auto states = std::make_unique<LiveStates>(read_with_surface(rest));
  LiveStates* live = states.get();
  if (o.color != "segment") hexmesh::color_range(live->now(), o.color);  // refuses what there is not
  const std::optional<hexmesh::IntensityVolume> scan = read_scan_of(live->now(), scan_file, console);

  if (!o.output.empty()) arguments.insert(arguments.end(), {"-o", o.output});
  if (!o.record.empty()) arguments.insert(arguments.end(), {"--record", o.record});
  if (common.force) arguments.push_back("--force");
  Solver solver(arguments);
  if (o.pace > 0) solver.send(fmt::format("pace {}", o.pace));
  for (const ScriptLine& line : script)  // hexsolve waits for their times itself, to the step
    if (is_of_solver(line)) solver.send_for(line.time.value_or(0), fmt::format("{}", fmt::join(line.words, " ")));
  std::erase_if(script, is_of_solver);
  Session session(o, std::move(states), live, &solver, scan ? &*scan : nullptr, std::move(script), std::move(pictures),
                  console);
  session.run();
  const int code = solver.wait();
  if (code > 128 && session.signal() == 0)
    console.error(fmt::format("hexsolve was ended by signal {}: {} not written", code - 128,
                              o.output.empty() ? "the motion is" : "'" + o.output + "' is"));
  const int own = finish(session, files, console);
  return code != 0 ? code : own;
}

}  // namespace

int main(int argc, char** argv) {
  auto o = std::make_shared<ViewOptions>();
  return run_tool(
      argc, argv,
      {"hexview", "A window on a result, or on a body that is pulled with the mouse while hexsolve moves it.",
       "hexview liver.hexmesh swing.toml --scan ct.nrrd -o pulled.hexresult",
       [o](CLI::App& app, const CommonOptions& common, const Console& console) -> std::function<int()> {
         add_options(app, *o);
         return [=, &common, &console] {
           return o->scene.empty() ? look_at_result(*o, common, console) : move_body(*o, common, console);
         };
       }});
}
