// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <fstream>

#include "bench/accuracy.h"
#include "bench/compare.h"
#include "bench/machine.h"
#include "bench/motion.h"
#include "bench/paper.h"
#include "bench/speed.h"
#include "cli/tool.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/dataset_compare.h"
#include "hexmesh/file/lattice_file.h"
#include "hexmesh/lattice/assign.h"
#include "hexmesh/scan/image_io.h"
#include "hexsolver/equilibrium.h"

namespace {

using namespace hextools;
using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Lattice;

constexpr int exit_differs = 1;  // of --exact, as of cmp and diff

struct Options {
  std::string input, scene, output = "-", csv, second;
  std::vector<std::string> experiments;
  int repeats = 5, level = 0;
  bool exact = false;
  AccuracyOptions accuracy;
};

/// A lattice file, or a segmentation whose segments get the named defaults of their tissues.
Lattice read_body(const std::string& name, const Console& console) {
  const hexmesh::InputFile file(name);
  std::string start(8, '\0');
  std::ifstream(file.path(), std::ios::binary).read(start.data(), 8);
  if (start == "\x89HDF\r\n\x1a\n") return hexmesh::read_lattice(file.path());
  const hexmesh::LabelVolume labels = hexmesh::read_labels(file.path(), {.warn = warning_on(console)});
  hexmesh::AssignedMaterials materials = hexmesh::assign_materials(labels, {});
  for (const std::string& note : materials.notes) console.note(note);
  return hexmesh::build_lattice(labels, std::move(materials.segments));
}

int bench_scene(const Options& o, const CLI::App& command, const CommonOptions& common, const Console& console) {
  const hexmesh::InputFile file(o.input);
  const Lattice read = hexmesh::read_lattice(file.path());
  if (command.get_name() == "lattice") {
    write_text(o.output, bench_lattice(read, o.repeats).dump(2) + "\n", common);
    return 0;
  }
  hexsolver::Scene scene = hexsolver::read_scene(o.scene, o.scene);
  scene.level = o.level;
  const Lattice as_asked = hexsolver::with_overrides(read, scene);
  const int level = hexsolver::finest_level(scene, read);
  const bool wants_motion = command.get_name() == "motion";
  if (wants_motion != scene.dynamics.has_value())
    throw Error(ErrorKind::usage, fmt::format("the scene is {}, expected {}", scene.dynamics ? "a motion" : "no motion",
                                              wants_motion ? "one" : "an equilibrium"));
  const nlohmann::json report = command.get_name() == "solver" ? bench_solver(as_asked, scene, level, o.repeats)
                                : wants_motion                 ? bench_motion(as_asked, scene, level, console)
                                               : bench_effects(as_asked, scene, level, o.repeats, console);
  write_text(o.output, report.dump(2) + "\n", common);
  return 0;
}

int accuracy(const Options& o, const CommonOptions& common, const Console& console) {
  hexsolver::Scene scene = hexsolver::read_scene(o.scene, o.scene);
  if (scene.dynamics) throw Error(ErrorKind::usage, "the scene is a motion, expected an equilibrium");
  scene.accuracy.reset();
  scene.budget.reset();
  const Experiment experiment{hexsolver::with_overrides(read_body(o.input, console), scene), scene};
  const AccuracyTables tables = bench_accuracy(experiment, o.accuracy, console);
  const Row report = {{"about", tables.about}, {"equilibria", tables.equilibria}, {"motions", tables.motions}};
  write_text(o.output, report.dump(2) + "\n", common);
  if (!o.csv.empty()) write_text(o.csv, to_csv(tables.equilibria), common);
  return 0;
}

int paper(const Options& o, const CommonOptions& common, const Console& console) {
  std::vector<std::string> names = o.experiments;
  std::replace(names.begin(), names.end(), std::string("fig14"), std::string("table3"));  // its pictures
  if (names.empty()) names = paper_experiments();
  std::string text;
  Row report;
  for (const std::string& name : names) {
    const std::vector<Row> rows = run_paper_experiment(name, console);
    text += to_markdown(name, rows);
    report[name] = rows;
  }
  write_text(o.output, text, common);
  if (!o.csv.empty()) write_text(o.csv, report.dump(2) + "\n", common);
  return 0;
}

int compare_results(const Options& o, const CommonOptions& common, const Console& console) {
  const hexmesh::InputFile first(o.input);
  if (!o.exact) {
    const Row row = compare(hexmesh::read_result(first.path()), read_points(hexmesh::InputFile(o.second).path()));
    write_text(o.output, row.dump(2) + "\n", common);
    return 0;
  }
  const hexmesh::InputFile second(o.second);
  Row report = Row::array();
  for (const hexmesh::DatasetDifference& d : hexmesh::compare_datasets(first.path(), second.path())) {
    console.note(
        fmt::format("{} {}{}", d.name, d.what, d.largest > 0 ? fmt::format(", by {:.3g} at most", d.largest) : ""));
    report.push_back({{"dataset", d.name}, {"what", d.what}, {"largest", d.largest}});
  }
  if (report.empty()) console.note("all datasets are the same");
  write_text(o.output, report.dump(2) + "\n", common);
  return report.empty() ? 0 : exit_differs;
}

}  // namespace

int main(int argc, char** argv) {
  auto o = std::make_shared<Options>();
  return run_tool(
      argc, argv,
      {"hexbench", "Measure what accuracy costs, and how fast this machine does what the tools do; medians.",
       "hexbench lattice liver.hexmesh",
       [o](CLI::App& app, const CommonOptions& common, const Console& console) -> std::function<int()> {
         app.require_subcommand(1);
         CLI::App* machine = app.add_subcommand(
             "machine", "What this machine can do at most: memory bandwidth and fused multiply-adds");
         CLI::App* lattice = app.add_subcommand("lattice", "Element recursion of all levels, against memcpy");
         CLI::App* solver = app.add_subcommand("solver", "Multigrid of one level, against its operator product");
         CLI::App* effects =
             app.add_subcommand("effects", "What each effect of a scene costs and changes, one added after the other");
         CLI::App* motion = app.add_subcommand(
             "motion", "Steps per second of a motion on every level, and what its solvers cost and miss");
         for (CLI::App* sub : {lattice, solver, effects, motion})
           sub->add_option("lattice", o->input, "Lattice file; - is standard input")->required();
         for (CLI::App* sub : {machine, lattice, solver, effects, motion})
           sub->add_option("--repeats", o->repeats, "Runs of which the median counts")
               ->check(CLI::Range(1, 1000))
               ->capture_default_str();
         for (CLI::App* sub : {solver, effects, motion}) {
           sub->add_option("scene", o->scene, "Scene file (TOML)")->required();
           sub->add_option("--level", o->level, "Which level; 0 = voxels")
               ->check(CLI::Range(0, 30))
               ->capture_default_str();
         }

         CLI::App* curve =
             app.add_subcommand("accuracy", "Cells of all levels and tetrahedra of many sizes: error, time and memory");
         curve->add_option("body", o->input, "Lattice file, or segmented scan; - is standard input")->required();
         curve->add_option("scene", o->scene, "Scene of an equilibrium (TOML)")->required();
         curve->add_option("--csv", o->csv, "The equilibria as comma-separated values");
         curve->add_option("--laws", o->accuracy.laws, "cauchy, corotational, green-lagrange")
             ->delimiter(',')
             ->capture_default_str();
         curve->add_option("--tolerances", o->accuracy.tolerances, "Relative residuals to solve to")
             ->delimiter(',')
             ->check(CLI::Range(1e-12, 0.1))
             ->capture_default_str();
         curve
             ->add_option("--iterations", o->accuracy.iterations,
                          "Conjugate gradient iterations of a step of motion; 0: no motion")
             ->delimiter(',')
             ->check(CLI::Range(0, 1000))
             ->capture_default_str();
         add_repeated(*curve, "--mesh", o->accuracy.meshes, "Tetrahedra to compare as well (.vtu, .msh, .inp)");
         curve->add_option("--most-elements", o->accuracy.most_elements, "Of cells or tetrahedra to compare")
             ->check(CLI::Range(1e2, 1e8))
             ->capture_default_str();
         curve
             ->add_option("--reference-tets", o->accuracy.reference_tets,
                          "About how many of 10 nodes are the reference")
             ->check(CLI::Range(1e2, 1e7))
             ->capture_default_str();
         curve->add_option("--repeats", o->accuracy.repeats, "Runs of which the median counts")
             ->check(CLI::Range(1, 100))
             ->capture_default_str();

         CLI::App* published = app.add_subcommand("paper", "The paper's tables and figures, measured; Markdown");
         published->add_option("experiments", o->experiments,
                               "table1, fig4, fig5, fig7, table2, table3 (or fig14), uniform; all if none is named");
         published->add_option("--json", o->csv, "All rows with all columns");

         CLI::App* against = app.add_subcommand(
             "compare", "A result against points of another solution, or two results dataset by dataset");
         against->add_option("result", o->input, "Result file; - is standard input")->required();
         against
             ->add_option("reference", o->second,
                          "CSV with x, y, z, ux, uy, uz in mm, LPS (may be gzipped); with --exact a result file")
             ->required();
         against->add_flag("--exact", o->exact,
                           "Which datasets of two results are not equal bit for bit; exit 1 if there are any");
         for (CLI::App* sub : {machine, lattice, solver, effects, motion, curve, published, against})
           sub->add_option("-o,--output", o->output, "JSON (paper: Markdown); - is standard output")
               ->capture_default_str();
         return [=, &app, &common, &console] {
           std::erase(o->accuracy.iterations, 0);
           if (machine->parsed()) {
             write_text(o->output, bench_machine(o->repeats).dump(2) + "\n", common);
             return 0;
           }
           if (curve->parsed()) return accuracy(*o, common, console);
           if (published->parsed()) return paper(*o, common, console);
           if (against->parsed()) return compare_results(*o, common, console);
           return bench_scene(*o, *app.get_subcommands().front(), common, console);
         };
       }});
}
