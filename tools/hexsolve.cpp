// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <omp.h>

#include <nlohmann/json.hpp>

#include "cli/tool.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/lattice_file.h"
#include "hexsolver/equilibrium.h"

namespace {

using namespace hextools;
using hexmesh::Error;
using hexmesh::ErrorKind;
using hexsolver::SolveReport;
using nlohmann::json;

struct Options {
  std::string lattice, scene, output, report;
  std::vector<std::string> settings;
  int level = -1;
  bool example = false;
};

json to_json(const SolveReport& r, const hexsolver::Scene& scene) {
  json out;
  out["converged"] = r.converged;
  out["reason"] = r.reason;
  const hexsolver::NewtonReport& last = r.levels.back().newton;
  out["newton_iterations"] = last.iterations;
  out["linear_iterations"] = last.linear_iterations;
  out["relative_residual"] = r.relative_residual;
  out["load_fraction"] = r.load_fraction;
  out["constraint_violation_mm"] = r.constraint_violation_mm;
  out["kept_directions"] = r.kept_directions;
  for (const hexsolver::ConditionReport& c : r.conditions)
    out["conditions"].push_back({{"name", c.name},
                                 {"points", c.points},
                                 {"misfit_mm", c.misfit_mm},
                                 {"reaction_n", {c.reaction_n[0], c.reaction_n[1], c.reaction_n[2]}}});
  for (const hexsolver::ForceReport& f : r.forces)
    out["forces"].push_back({{"name", f.name}, {"total_n", {f.total_n[0], f.total_n[1], f.total_n[2]}}});
  out["strain_energy_n_mm"] = r.strain_energy_n_mm;
  out["min_jacobian"] = r.min_jacobian;
  out["inverted_cells"] = r.inverted_cells;
  out["strain"] = scene.strain == hexsolver::Strain::cauchy ? "cauchy" : "corotational";
  out["stiffness"] = scene.stiffness == hexsolver::Stiffness::exact ? "exact" : "uniform";
  out["volumetric"] = scene.volumetric == hexsolver::Volumetric::mean ? "mean" : "full";
  for (const hexsolver::LevelReport& l : r.levels)
    out["levels"].push_back({{"level", l.level},
                             {"cells", l.cells},
                             {"dofs", 3 * l.nodes},
                             {"seconds", l.seconds},
                             {"newton_iterations", l.newton.iterations},
                             {"linear_iterations", l.newton.linear_iterations},
                             {"relative_residual", l.newton.relative_residual},
                             {"converged", l.newton.converged}});
  const hexsolver::LevelReport& finest = r.levels.back();
  out["lattice"] = {
      {"level", finest.level}, {"cells", finest.cells}, {"nodes", finest.nodes}, {"dofs", 3 * finest.nodes}};
  return out;
}

void summarize(const SolveReport& r, const Console& console) {
  const hexsolver::LevelReport& l = r.levels.back();
  console.note(
      fmt::format("level {}: {} cells, {} dofs, {} Newton steps, {} linear iterations, residual {:.1e}, "
                  "{:.2f} s in all levels",
                  l.level, l.cells, 3 * l.nodes, l.newton.iterations, l.newton.linear_iterations, r.relative_residual,
                  r.solve_seconds));
  for (const hexsolver::ConditionReport& c : r.conditions)
    console.note(fmt::format("condition '{}': {} points, misfit {:.2g} mm, reaction [{:.4g}, {:.4g}, {:.4g}] N", c.name,
                             c.points, c.misfit_mm, c.reaction_n[0], c.reaction_n[1], c.reaction_n[2]));
  console.note(fmt::format("strain energy {:.6g} N mm, smallest Jacobian {:.3g}, {} inverted cells",
                           r.strain_energy_n_mm, r.min_jacobian, r.inverted_cells));
}

int run(const Options& o, const CommonOptions& common, const Console& console) {
  const double start = omp_get_wtime();
  const hexmesh::InputFile lattice_file(o.lattice);
  if (o.example) {
    write_text(o.output.empty() ? "-" : o.output,
               hexsolver::example_scene(hexmesh::read_lattice(lattice_file.path(), {-1})), common);
    return 0;
  }
  if (o.scene.empty() || o.output.empty())
    throw Error(ErrorKind::usage, "SCENE and -o are missing, expected hexsolve LATTICE SCENE -o RESULT");
  if (o.scene == "-") throw Error(ErrorKind::usage, "SCENE is -, expected a file");
  const hexmesh::InputFile scene_file(o.scene);
  std::vector<std::string> settings = o.settings;
  if (o.level >= 0) settings.push_back(fmt::format("solve.level={}", o.level));
  const hexsolver::Scene scene = hexsolver::read_scene(scene_file.path(), o.scene, settings);
  const auto output = open_output(o.output, "", common, {o.lattice, o.scene});

  const hexmesh::Lattice lattice = [&] {
    std::vector<int> wanted;
    if (scene.level)
      for (int n = *scene.level; n < hexmesh::count_levels(lattice_file.path()); ++n) wanted.push_back(n);
    return hexsolver::with_overrides(hexmesh::read_lattice(lattice_file.path(), wanted), scene);
  }();
  const int level = hexsolver::mechanical_level(scene, lattice);
  const double read_done = omp_get_wtime();

  SolveReport report;
  hexsolver::SolveProgress progress;
  if (console.shows_progress())
    progress = [&](int number, double load, int step, double residual, int linear) {
      console.progress(fmt::format("level {}, load {:.3g}, Newton step {}: residual {:.2e}, {} linear iterations",
                                   number, load, step, residual, linear));
    };
  hexmesh::Result result = hexsolver::solve_equilibrium(lattice, scene, level, report, progress);

  json summary = to_json(report, scene);
  result.history = lattice.history;
  result.history.push_back(command_line());
  result.report = summary.dump();
  const double solve_done = omp_get_wtime();
  hexmesh::write_result(result, output->path());
  output->commit();
  summary["seconds"] = {{"read", read_done - start},
                        {"setup", report.setup_seconds},
                        {"solve", report.solve_seconds},
                        {"write", omp_get_wtime() - solve_done},
                        {"total", omp_get_wtime() - start}};
  summary["peak_memory_mb"] = peak_memory_mb();
  summarize(report, console);
  if (!o.report.empty()) write_text(o.report, summary.dump(2) + "\n", common);
  if (report.converged) return 0;
  fmt::print(stderr, "hexsolve: error: not converged: {}; '{}' holds the last state that did, marked so\n",
             report.reason, o.output);
  return exit_not_converged;
}

}  // namespace

int main(int argc, char** argv) {
  auto o = std::make_shared<Options>();
  return run_tool(
      argc, argv,
      {"hexsolve", "Solve a lattice to static equilibrium under a scene (TOML).",
       "hexsolve liver.hexmesh liver.toml --level 2 -o liver.hexresult",
       [o](CLI::App& app, const CommonOptions& common, const Console& console) -> std::function<int()> {
         app.add_option("lattice", o->lattice, "Lattice file of hexmesh build; - is standard input")->required();
         app.add_option("scene", o->scene, "Scene file (TOML)");
         app.add_option("--level", o->level,
                        "Mechanical level, 0 = voxels; without it and without solve.level the finest of at most 20000 "
                        "cells")
             ->check(CLI::Range(0, 30));
         add_repeated(app, "--set", o->settings, "KEY=VALUE: override a key of the scene, e.g. solve.strain=cauchy");
         app.add_flag("--example", o->example,
                      "Print a scene for this lattice: three places held, a fourth pulled by 40 mm");
         app.add_option("--report", o->report, "Write a JSON report; - is standard output");
         app.add_option("-o,--output", o->output, "Result file (.hexresult, HDF5); - is standard output");
         return [=, &common, &console] { return run(*o, common, console); };
       }});
}
