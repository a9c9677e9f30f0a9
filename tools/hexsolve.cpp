// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <omp.h>

#include "cli/json_text.h"
#include "cli/scene_input.h"
#include "cli/solve_history.h"
#include "cli/solve_report.h"
#include "cli/solve_run.h"
#include "hexmesh/core/error.h"
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
  if (o.scene.empty() || (solves && o.output.empty() && o.stream.empty()))
    throw Error(ErrorKind::usage, fmt::format("{} is missing, expected hexsolve LATTICE SCENE -o RESULT",
                                              o.scene.empty() ? "SCENE" : "-o RESULT"));
}

/// What a call asks for is said once.
void check_settings(const SolveOptions& o) {
  const auto expect_one = [&](bool is_asked, const char* option) {
    for (const char* key : {"solve.level", "solve.accuracy_mm", "solve.accuracy_reactions", "solve.budget_s"})
      for (const std::string& s : o.settings)
        if (is_asked && s.starts_with(std::string(key) + "="))
          throw Error(ErrorKind::usage, fmt::format("--set {} and {} are both given, expected one of them", s, option));
  };
  expect_one(!o.levels.empty(), "--level");
  expect_one(!o.accuracy.empty(), "--accuracy");
  expect_one(o.request.budget.has_value(), "--budget");
}

/// The scene of the file with what the command line overrides.
Scene read_scene(const SolveOptions& o, const Input& input, RunFiles& files, const Console& console) {
  check_settings(o);
  Scene scene = hextools::read_scene(input, files, o.settings);
  apply(o.request, scene);
  for (const std::string& w : scene.warnings) console.warning(w);
  for (const auto& [option, is_given] : {std::pair("--stream", !o.stream.empty()), {"--steer", !o.steer.empty()}})
    if (is_given && !scene.dynamics)
      throw Error(ErrorKind::usage, fmt::format("{} goes with a motion, expected solve.kind = \"dynamics\"", option));
  if (!o.stream.empty() && o.stream != "surface" && o.stream != "nodes")
    throw Error(ErrorKind::usage, fmt::format("--stream is '{}', expected surface or nodes", o.stream));
  if (!o.stream.empty() && (o.output == "-" || o.report == "-"))
    throw Error(ErrorKind::usage, "--stream takes standard output, expected -o and --report with a file or none");
  return scene;
}

int write_example(const SolveOptions& o, const CommonOptions& common) {
  RunFiles files(common);
  const Input& lattice = files.input(o.lattice);
  Output& output = files.output(o.output.empty() ? "-" : o.output, Content::text, ".toml");
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
  if (!o.stream.empty()) files.reserve_standard_output(Content::binary);
  if (!o.steer.empty()) files.input(o.steer, Content::text);  // read as it comes, in place
  if (o.plan && !o.output.empty()) throw Error(ErrorKind::usage, "-o goes with a solution or --check, not with --plan");
  Output* output = files.output_if_named(o.output, Content::binary, ".hexresult");
  Output* report_file = files.output_if_named(o.report, Content::text, ".json");
  Output* record_file = files.output_if_named(o.record, Content::text);
  int level = 0;
  const hexmesh::Lattice lattice =
      read_lattice(lattice_file.path(), scene, o.request.level, !o.stream.empty() || !o.steer.empty(), level);
  const auto history = [&] {
    std::vector<std::string> lines = lattice.history;
    lines.push_back(solve_history(o.lattice, lattice_file.path(), o.scene, scene_file.path(), scene));
    return lines;
  };
  if (o.check)
    return show_check(hexsolver::check_scene(lattice, scene, level, output != nullptr), scene, report_file, output,
                      lattice_file.path(), history(), files, console);
  const double read_done = omp_get_wtime();
  if (o.plan) {
    hexsolver::SolvePlan plan = hexsolver::plan_solution(lattice, scene, level);
    plan.reading_seconds = read_done - start;
    return show_plan(plan, report_file, files);
  }
  level = fit_into_memory(lattice, level, scene, console);

  std::optional<hexmesh::ResultWriter> writer;
  if (output && scene.dynamics) writer.emplace(output->path());
  std::optional<Interruption> interruption;
  if (scene.dynamics) interruption.emplace();  // of a motion what there is can be gone on from
  MotionIo io;
  io.writer = writer ? &*writer : nullptr;
  if (!o.stream.empty()) io.streamed = o.stream == "nodes" ? Streamed::nodes : Streamed::surface;
  io.steer = o.steer;
  auto [result, report] = scene.dynamics ? solve_motion(lattice, scene, level, io, *interruption, console)
                                         : solve_equilibrium(lattice, scene, level, console);

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
  add_times(summary, report, {start, read_done}, solve_done);
  if (report_file) report_file->write(json_text(summary));
  if (record_file) record_file->write(io.record);
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
