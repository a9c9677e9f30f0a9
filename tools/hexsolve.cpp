// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <omp.h>

#include "cli/json_text.h"
#include "cli/scene_input.h"
#include "cli/solve_report.h"
#include "hexmesh/core/error.h"
#include "hexmesh/core/memory.h"
#include "hexmesh/file/lattice_file.h"
#include "hexmesh/file/result_file.h"
#include "hexsolve/motion.h"
#include "hexsolve/options.h"
#include "hexsolve/show.h"

namespace {

using namespace hextools;
using hexmesh::Error;
using hexmesh::ErrorKind;
using hexsolver::Scene;
using hexsolver::SolveReport;
using nlohmann::json;

void check_names(const SolveOptions& o, bool solves) {
  if (o.scene.empty() || (solves && o.output.empty() && !o.stream))
    throw Error(ErrorKind::usage, fmt::format("{} is missing, expected hexsolve LATTICE SCENE -o RESULT",
                                              o.scene.empty() ? "SCENE" : "-o RESULT"));
}

/// The scene of the file with what the command line overrides.
Scene read_scene(const SolveOptions& o, const Input& input, RunFiles& files, const Console& console) {
  Scene scene = hextools::read_scene(input, files, o.settings);
  if (scene.dynamics && (!o.accuracy.empty() || o.budget))
    throw Error(ErrorKind::usage,
                fmt::format("{} goes with an equilibrium, but the scene is a motion, expected --level",
                            o.budget ? "--budget" : "--accuracy"));
  for (const std::string& w : scene.warnings) console.warning(w);
  if (o.level || !o.accuracy.empty() || o.budget) {
    scene.name_level(o.level);
    scene.accuracy = o.accuracy_mm;
    scene.reaction_accuracy = o.accuracy_reactions;
    scene.budget = o.budget;
  }
  if (o.coarser_by) {
    scene.grading = hexsolver::Grading::scene;
    scene.coarser_by = *o.coarser_by;
  }
  if (o.stream && !scene.dynamics)
    throw Error(ErrorKind::usage, "--stream goes with a motion, expected solve.kind = \"dynamics\"");
  if (o.stream && (o.output == "-" || o.report == "-"))
    throw Error(ErrorKind::usage, "--stream takes standard output, expected -o and --report with a file or none");
  return scene;
}

/// What the scene needs, with its materials.
/// @param level  becomes the finest that it asks for
hexmesh::Lattice read_lattice(const SolveOptions& o, const std::filesystem::path& path, const Scene& scene,
                              int& level) {
  hexsolver::LatticeNeeds needs;
  needs.pictures = o.stream;
  if (scene.level != 0) {  // of which there is one always, and it needs all
    const std::vector<std::size_t> num_cells = hexmesh::cells_of_levels(path);
    const int count = static_cast<int>(num_cells.size());
    if (o.level && *o.level >= count)
      throw Error(ErrorKind::usage, fmt::format("--level is {}, expected 0 to {}", *o.level, count - 1));
    level = hexsolver::finest_level(scene, num_cells);
    for (int n = hexsolver::finest_level_needed(scene, num_cells, level); n < count; ++n) needs.levels.push_back(n);
  }
  const hexsolver::LatticeNeeds all = {{}, true};
  if (scene.islands != hexsolver::Islands::error && scene.is_open_ended())
    return hexsolver::read_lattice_for(scene, path, all);
  hexmesh::Lattice lattice = hexsolver::read_lattice_for(scene, path, needs);
  if (hexsolver::leaves_islands_out(lattice, scene, level)) lattice = hexsolver::read_lattice_for(scene, path, all);
  return lattice;
}

/// Save memory if the finest level would not fit otherwise; an accuracy or a budget may end on a coarser one.
/// @returns the finest level that fits
/// @throws Error{input} if the level asked does not
int fit_into_memory(const hexmesh::Lattice& lattice, int finest, Scene& scene, const Console& console) {
  const double allowed = 1e-6 * hexmesh::memory_left();
  const auto expected = [&](int level) { return megabytes(hexsolver::expected_bytes(lattice, scene, level)); };
  const double fastest = expected(finest);
  if (fastest <= allowed) return finest;
  scene.saves_memory = true;
  int level = finest;
  const int most = scene.is_open_ended() ? static_cast<int>(lattice.levels.size()) - 1 : finest;
  while (level < most && expected(level) > allowed) ++level;
  const std::string what = fmt::format("level {} ({} cells) would take about {:.3g} MB", finest,
                                       lattice.levels[static_cast<std::size_t>(finest)].cells.size(), fastest);
  if (expected(level) > allowed)
    throw Error(ErrorKind::input,
                fmt::format("{}, {:.3g} MB at the least, expected at most {:.3g} MB that are left (--max-memory): "
                            "solve a coarser level",
                            what, expected(level), allowed));
  console.note(fmt::format("{}: to save memory it takes longer{}", what,
                           level > finest ? fmt::format(", and level {} is the finest", level) : ""));
  return level;
}

SolveWork work_of(const hexmesh::Lattice& lattice, const Scene& scene, int finest) {
  SolveWork work{{}, finest, scene.tolerance};
  if (!scene.is_open_ended())
    for (const hexmesh::Level& level : lattice.levels) work.cells.push_back(level.cells.size());
  return work;
}

/// Says on standard error what is wrong with a solution. @returns the exit code
int judge(const SolveReport& report, const std::string& output, const Console& console) {
  if (report.accuracy_missed) {
    console.error(fmt::format("accuracy not reached: {}; '{}' holds that level, solved", report.reason, output));
    return exit_not_converged;
  }
  if (report.converged) return 0;
  console.error(fmt::format("{}{}{}", report.interrupted ? "" : "not converged: ", report.reason,
                            output.empty() ? "" : what_is_kept(report, output)));
  return exit_not_converged;
}

int write_example(const SolveOptions& o, const CommonOptions& common) {
  RunFiles files(common);
  const Input& lattice = files.input(o.lattice);
  Output& output = files.output(o.output.empty() ? "-" : o.output, Content::text);
  output.write(hexsolver::example_scene(hexmesh::read_lattice(lattice.path(), {-1})));
  files.commit();
  return 0;
}

int run(const SolveOptions& o, const CommonOptions& common, const Console& console) {
  const double start = omp_get_wtime();
  if (o.example) return write_example(o, common);
  const bool solves = !o.check && !o.plan;
  check_names(o, solves);
  RunFiles files(common);
  const Input& lattice_file = files.input(o.lattice);
  const Input& scene_file = files.input(o.scene, Content::text);
  Scene scene = read_scene(o, scene_file, files, console);
  if (o.stream) files.reserve_standard_output(Content::binary);
  if (o.plan && !o.output.empty()) throw Error(ErrorKind::usage, "-o goes with a solution or --check, not with --plan");
  Output* output = files.output_if_named(o.output, Content::binary);
  Output* report_file = files.output_if_named(o.report, Content::text);
  int level = 0;
  const hexmesh::Lattice lattice = read_lattice(o, lattice_file.path(), scene, level);
  const auto history = [&] {
    std::vector<std::string> lines = lattice.history;
    lines.push_back(solve_history(o.lattice, lattice_file.path(), o.scene, scene_file.path(), scene));
    return lines;
  };
  if (o.check)
    return show_check(hexsolver::check_scene(lattice, scene, level, output != nullptr), scene, report_file, output,
                      lattice_file.path(), history(), files, console);
  if (o.plan) return show_plan(hexsolver::plan_solution(lattice, scene, level), report_file, files);
  const double read_done = omp_get_wtime();
  level = fit_into_memory(lattice, level, scene, console);

  std::optional<hexmesh::ResultWriter> writer;
  if (output && scene.dynamics) writer.emplace(output->path());
  std::optional<Interruption> interruption;
  if (scene.dynamics) interruption.emplace();  // of a motion what there is can be gone on from
  auto [result, report] =
      scene.dynamics
          ? solve_motion(lattice, scene, level, writer ? &*writer : nullptr, o.stream, *interruption, console)
          : hexsolver::solve_equilibrium(lattice, scene, level, progress_on(console, work_of(lattice, scene, level)));

  json summary = to_json(report, scene);
  result.history = history();
  result.report = json_line(summary);
  result.costs = json_line(costs_of(report, read_done - start));
  const double solve_done = omp_get_wtime();
  if (writer)
    writer->finish(result, lattice_file.path());
  else if (output)
    hexmesh::write_result(result, output->path(), lattice_file.path());
  if (output) output->prepare();
  summary["seconds"] = {{"read", read_done - start},
                        {"setup", report.setup_seconds},
                        {"solve", report.solve_seconds},
                        {"write", omp_get_wtime() - solve_done},
                        {"total", omp_get_wtime() - start}};
  add_costs(summary, report);
  if (report_file) report_file->write(json_text(summary));
  files.commit();
  for (const std::string& w : report.warnings) console.warning(w);
  summarize(report, console);
  const int code = judge(report, o.output, console);
  return report.interrupted ? 128 + interruption->signal() : code;
}

}  // namespace

int main(int argc, char** argv) {
  auto o = std::make_shared<SolveOptions>();
  return run_tool(argc, argv,
                  {"hexsolve", "Solve a lattice under a scene (TOML): its static equilibrium, or its motion.",
                   "hexsolve liver.hexmesh liver.toml --level 2 -o liver.hexresult",
                   [o](CLI::App& app, const CommonOptions& common, const Console& console) -> std::function<int()> {
                     add_options(app, *o);
                     return [=, &common, &console] { return run(*o, common, console); };
                   }});
}
