// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <omp.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <optional>

#include "cli/json_text.h"
#include "cli/progress.h"
#include "cli/run_files.h"
#include "cli/solve_history.h"
#include "cli/solve_report.h"
#include "distributed/shared_equilibrium.h"
#include "hexmesh/core/error.h"
#include "hexsolver/scene/scene_files.h"

namespace {

using namespace hextools;
using hexmesh::Error;
using hexmesh::ErrorKind;
using hexsolver::SolveReport;
using hexsolver::mpi::ProcessReport;
using hexsolver::mpi::Run;
using nlohmann::json;

struct Options {
  std::string lattice, scene, output, report;
  std::vector<std::string> settings;
  std::optional<int> level;
};

json to_json(const std::vector<ProcessReport>& processes) {
  json out = json::array();
  for (const ProcessReport& p : processes)
    out.push_back({{"cells", p.cells},
                   {"nodes", p.nodes},
                   {"nodes_of_others", p.nodes_of_others},
                   {"cells_read", p.cells_read},
                   {"voxels_read", p.voxels_read},
                   {"condition_nodes", p.condition_nodes},
                   {"peak_memory_mb", p.peak_memory_mb}});
  return out;
}

hexsolver::Scene read_scene(const Options& o) {
  hexsolver::Scene scene = hexsolver::read_scene(o.scene, o.scene, o.settings);
  if (o.level) scene.name_level(o.level);
  return scene;
}

int solve(const Run& run, const Options& o, const CommonOptions& common, const Console& console) {
  const double start = omp_get_wtime();
  hexsolver::Scene scene;
  RunFiles files(common);  // of the first process
  Output *output = nullptr, *report_file = nullptr;
  run.on_first([&] {  // every process reads them, but only one tells what is wrong
    if (o.scene.empty() || o.output.empty())
      throw Error(ErrorKind::usage, fmt::format("{} is missing, expected hexsolve-mpi LATTICE SCENE -o RESULT",
                                                o.scene.empty() ? "SCENE" : "-o RESULT"));
    for (const std::string* name : {&o.lattice, &o.scene, &o.output})
      if (*name == "-") throw Error(ErrorKind::usage, "- is standard input or output, expected a file for each");
    files.input(o.lattice);
    files.input(o.scene, Content::text);
    scene = read_scene(o);
    hexsolver::mpi::check_is_shareable(scene);
    for (const std::filesystem::path& file : hexsolver::files_of(scene)) files.input(file.string());
    output = &files.output(o.output, Content::binary, ".hexresult");
    report_file = files.output_if_named(o.report, Content::text, ".json");
  });
  std::optional<ProgressTeller> teller;
  if (run.is_first()) teller.emplace("hexsolve-mpi", common);
  if (!run.is_first()) scene = read_scene(o);
  if (run.is_first())
    for (const std::string& w : scene.warnings) console.warning(w);

  std::vector<ProcessReport> processes;
  json summary;
  const SolveReport report = hexsolver::mpi::solve_equilibrium(
      run, o.lattice, scene, run.of_first(output ? output->path().string() : ""), processes,
      [&](hexmesh::Result& result, const SolveReport& solved) {
        summary = hextools::to_json(solved, scene);
        result.report = json_line(summary);
        result.costs = json_line(costs_of(solved, 0));
        result.history.push_back(solve_history(o.lattice, o.lattice, o.scene, o.scene, scene));
      },
      run.is_first() ? progress_on(console) : hexsolver::SolveProgress());
  teller.reset();
  run.on_first([&] {
    output->prepare();
    summary["seconds"] = {
        {"setup", report.setup_seconds}, {"solve", report.solve_seconds}, {"total", omp_get_wtime() - start}};
    add_costs(summary, report);
    summary["processes"] = to_json(processes);
    if (report_file) report_file->write(json_text(summary));
    files.commit();
    for (const std::string& w : report.warnings) console.warning(w);
    for (const std::string& option : run.unused_options())
      console.warning(fmt::format("PETSc did not ask for its option '{}' (misspelt?)", option));
    summarize(report, console);
    const auto [fewest, most] = std::minmax_element(processes.begin(), processes.end(),
                                                    [](const auto& a, const auto& b) { return a.cells < b.cells; });
    console.note(fmt::format("{} processes, {} to {} cells each", processes.size(), fewest->cells, most->cells));
  });
  if (report.accuracy_missed) {
    if (run.is_first())
      console.error(fmt::format("accuracy not reached: {}; '{}' holds that level, solved", report.reason, o.output));
    return exit_not_converged;
  }
  if (report.converged) return 0;
  if (run.is_first()) console.error(fmt::format("not converged: {}{}", report.reason, what_is_kept(report, o.output)));
  return exit_not_converged;
}

int loud_error = STDERR_FILENO;  ///< standard error, also where a process is silent

/// The first process speaks for all: the others say nothing, unless they alone know what went wrong.
void fall_silent() {
  loud_error = dup(STDERR_FILENO);
  if (!std::freopen("/dev/null", "w", stdout) || !std::freopen("/dev/null", "w", stderr)) std::perror("/dev/null");
}

/// Errors that all processes know end all of them, told by the first; one's own ends the others too.
int run_on_all(const Run& run, const Options& o, const CommonOptions& common, const Console& console) {
  try {
    return solve(run, o, common, console);
  } catch (const hexsolver::mpi::SharedError&) {
    throw;
  } catch (const std::exception& e) {
    const bool has_no_memory = dynamic_cast<const std::bad_alloc*>(&e) != nullptr;
    const int code = has_no_memory ? 3 : 70;
    const std::string line =
        error_line("hexsolve-mpi", fmt::format("a process failed alone, which ends all: {}", e.what()));
    if (write(loud_error, line.data(), line.size()) < 0) std::perror("standard error");
    run.abort(code);
  }
}

}  // namespace

int main(int argc, char** argv) {
  // What follows -- is for PETSc.
  const auto dashes = std::find_if(argv, argv + argc, [](const char* word) { return std::string_view(word) == "--"; });
  const std::vector<std::string> petsc_options(dashes == argv + argc ? dashes : dashes + 1, argv + argc);
  const Run run(petsc_options);
  if (!run.is_first()) fall_silent();
  auto o = std::make_shared<Options>();
  return run_tool(
      static_cast<int>(dashes - argv), argv,
      {"hexsolve-mpi",
       "Solve the static equilibrium of a lattice under a scene (TOML) by several processes, as hexsolve does by one: "
       "mpiexec -n 4 hexsolve-mpi ... What follows -- are options of PETSc, e.g. -- -pc_type gamg -ksp_monitor.",
       "mpiexec -n 2 hexsolve-mpi liver.hexmesh liver.toml --level 2 -o liver.hexresult",
       [o, &run](CLI::App& app, const CommonOptions& common, const Console& console) -> std::function<int()> {
         omp_set_num_threads(1);  // a process for each core, unless --threads says otherwise
         app.add_option("lattice", o->lattice, "Lattice file of hexmesh build")->required();
         app.add_option("scene", o->scene, "Scene file (TOML): an equilibrium without contacts and matches");
         app.add_option("--level", o->level,
                        "Mechanical level, 0 = voxels; without it and what the scene says the finest of at most 20000 "
                        "cells")
             ->check(CLI::Range(0, 30));
         add_repeated(app, "--set", o->settings, "KEY=VALUE: override a key of the scene, e.g. solve.strain=cauchy");
         app.add_option("--report", o->report, "Write a JSON report");
         app.add_option("-o,--output", o->output, "Result file (.hexresult, HDF5)");
         return [=, &run, &common, &console] { return run_on_all(run, *o, common, console); };
       },
       true});
}
