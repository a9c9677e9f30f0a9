// SPDX-License-Identifier: Apache-2.0
#include <fstream>

#include "accuracy_tables.h"
#include "cli/json_text.h"
#include "cli/scene_input.h"
#include "commands.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/lattice_file.h"
#include "hexmesh/lattice/assign.h"
#include "hexmesh/scan/image_io.h"
#include "scene_options.h"

namespace hextools {
namespace {

using hexmesh::Lattice;

struct Options {
  std::string body, scene, csv, output = "-";
  AccuracyOptions accuracy;
};

/// A lattice file, or a segmentation whose segments get the named defaults of their tissues.
Lattice read_body(const Input& file, const Console& console) {
  std::string start(8, '\0');
  std::ifstream(file.path(), std::ios::binary).read(start.data(), 8);
  if (start == "\x89HDF\r\n\x1a\n") return hexmesh::read_lattice(file.path());
  const hexmesh::LabelVolume labels = hexmesh::read_labels(file.path(), {.warn = warning_on(console)});
  hexmesh::AssignedMaterials materials = hexmesh::assign_materials(labels, {});
  for (const std::string& note : materials.notes) console.note(note);
  return hexmesh::build_lattice(labels, std::move(materials.segments));
}

int run_accuracy(const Options& o, const CommonOptions& common, const Console& console) {
  RunFiles files(common);
  const Input& body = files.input(o.body);
  hexsolver::Scene scene = read_scene(files.input(o.scene, Content::text), files);
  for (const std::string& mesh : o.accuracy.meshes) files.input(mesh);
  Output& output = files.output(o.output, Content::text);
  Output* csv = files.output_if_named(o.csv, Content::text);
  if (scene.dynamics) throw hexmesh::Error(hexmesh::ErrorKind::usage, "the scene is a motion, expected an equilibrium");
  scene.name_level({});
  const Experiment experiment{hexsolver::with_overrides(read_body(body, console), scene), scene};
  const AccuracyTables tables = bench_accuracy(experiment, o.accuracy, console);
  const Row report = {{"about", tables.about}, {"equilibria", tables.equilibria}, {"motions", tables.motions}};
  output.write(json_text(report));
  if (csv) csv->write(to_csv(tables.equilibria));
  files.commit();
  return 0;
}

}  // namespace

std::function<int()> declare_accuracy(CLI::App& app, const CommonOptions& common, const Console& console) {
  const auto o = std::make_shared<Options>();
  app.add_option("body", o->body, "Lattice file, or segmented scan; - is standard input")->required();
  app.add_option("scene", o->scene, "Scene of an equilibrium (TOML)")->required();
  app.add_option("--csv", o->csv, "The equilibria as comma-separated values");
  app.add_option("--laws", o->accuracy.laws, "cauchy, corotational, green-lagrange")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--tolerances", o->accuracy.tolerances, "Relative residuals to solve to")
      ->delimiter(',')
      ->check(CLI::Range(1e-12, 0.1))
      ->capture_default_str();
  app.add_option("--iterations", o->accuracy.iterations,
                 "Conjugate gradient iterations of a step of motion; 0: no motion")
      ->delimiter(',')
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  add_repeated(app, "--mesh", o->accuracy.meshes, "Tetrahedra to compare as well (.vtu, .msh, .inp)");
  app.add_option("--most-elements", o->accuracy.most_elements, "Of cells or tetrahedra to compare")
      ->check(CLI::Range(1e2, 1e8))
      ->capture_default_str();
  app.add_option("--reference-tets", o->accuracy.reference_tets, "About how many of 10 nodes are the reference")
      ->check(CLI::Range(1e2, 1e7))
      ->capture_default_str();
  app.add_option("--repeats", o->accuracy.repeats, "Runs of which the median counts")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  add_report(app, o->output);
  return [o, &common, &console] {
    std::erase(o->accuracy.iterations, 0);
    return run_accuracy(*o, common, console);
  };
}

}  // namespace hextools
