// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "cli/result_state.h"
#include "cli/tool.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/calculix_deck.h"
#include "hexmesh/file/lattice_file.h"
#include "hexmesh/lattice/embedded_points.h"
#include "hexmesh/view/vtk_export.h"

namespace {

using namespace hextools;
using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Result;

struct Options {
  std::string input, lattice, surface, csv, deck;
  int level = -1;
  bool deformed = false;
};

/// A result, or a level of a lattice file at rest.
Result read_input(const Options& o, const hexmesh::InputFile& input, const Console& console) {
  if (hexmesh::format_of(input.path()) == hexmesh::result_format) {
    if (o.level >= 0) throw Error(ErrorKind::usage, "--level goes with a lattice file, but the input is a result");
    return hexmesh::read_result(input.path());
  }
  if (!o.csv.empty() || !o.deck.empty() || o.deformed)
    throw Error(ErrorKind::usage, "--csv, --inp and --deformed go with a result, but the input is a lattice file");
  const int count = hexmesh::count_levels(input.path());
  const int level = std::max(o.level, 0);
  if (level >= count) throw Error(ErrorKind::input, fmt::format("level is {}, expected 0 to {}", level, count - 1));
  console.note(fmt::format("level {} of {}", level, count));
  return hexmesh::rest_state(hexmesh::read_lattice(input.path(), {level}), level);
}

void write_csv(const Result& result, const std::filesystem::path& path) {
  std::ofstream file(path);
  file << "node,x,y,z,ux,uy,uz\n";
  for (std::size_t n = 0; n < result.nodes.size(); ++n) {
    const hexmesh::Vec3 &x = result.nodes[n], &u = result.displacement[n];
    file << fmt::format("{},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}\n", n, x[0], x[1], x[2], u[0], u[1], u[2]);
  }
}

void write_deck(const Result& result, const std::filesystem::path& path) {
  const auto report = nlohmann::json::parse(result.report);
  const auto expect = [&](bool holds, const char* what, const char* expected) {
    if (!holds) throw Error(ErrorKind::input, fmt::format("--inp: {}, expected {}", what, expected));
  };
  expect(report.value("kind", "equilibrium") == "equilibrium", "the result is a motion", "an equilibrium");
  expect(report["converged"], "the result is not converged", "one that is");
  expect(report["forces"].empty(), "the scene has forces, which a deck does not hold yet", "displacements only");
  expect((!report.contains("contacts") || report["contacts"].empty()),
         "the scene has contacts, which a deck does not hold", "displacements only");
  expect(report["volumetric"] == "full", "C3D8 integrates the volumetric term fully", "solve.volumetric = \"full\"");
  expect(report["strain"] == "cauchy", "decks are written for small strain", "solve.strain = \"cauchy\"");
  expect(report["stiffness"] == "exact" && report["held_cells"] == 0, "springs or averaged cells have no counterpart",
         "a scene without");
  hexmesh::write_calculix_deck(result, path);
}

/// The result as it was at one of its steps; of the cell fields those that do not change.
class Steps {
public:
  Steps(const hexmesh::InputFile& file, const Result& result)
      : file_(file),
        result_(result),
        now_(result),
        surface_(hexmesh::CellLocator(result.voxels, result.voxels_per_cell, now_.cells), result.cell_nodes,
                 result.surface.points) {
    const std::set<std::string> constant = {"fill", "parts", "young_modulus", "poisson_ratio", "island"};
    std::erase_if(now_.cell_fields, [&](const auto& field) { return !constant.contains(field.first); });
  }

  const Result& at(std::size_t number) {
    hexmesh::MotionStep step = hexmesh::read_step(file_.path(), result_, number);
    now_.displacement = std::move(step.displacement);
    now_.velocity = std::move(step.velocity);
    surface_.interpolate({now_.displacement.front().data(), 3 * now_.displacement.size()}, now_.surface_displacement);
    return now_;
  }

private:
  const hexmesh::InputFile& file_;
  const Result& result_;
  Result now_;
  hexmesh::EmbeddedPoints surface_;
};

/// Those of an earlier series of the name, which --force replaces as a whole.
void remove_old_pieces(const std::filesystem::path& folder, const std::string& stem, const std::string& extension,
                       const CommonOptions& common) {
  if (!common.force) return;
  for (std::size_t n = 0;; ++n)
    if (!std::filesystem::remove(folder / fmt::format("{}_{:04}{}", stem, n, extension))) return;
}

/// NAME.pvd and the files it lists, NAME/NAME_0000.vtu, ...
template <class WriteStep>
void write_series(const std::string& name, const char* extension, const Result& result, const Options& o,
                  const hexmesh::InputFile& input, const CommonOptions& common, WriteStep&& write_step) {
  if (result.times.empty())
    throw Error(
        ErrorKind::usage,
        fmt::format("output '{}', but the result is no motion, expected a name that ends in {}", name, extension));
  const std::filesystem::path list(name), folder = list.parent_path() / list.stem();
  const auto file = open_output(name, ".pvd", common, {o.input});
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) throw Error(ErrorKind::output, fmt::format("cannot make the folder '{}'", folder.string()));
  remove_old_pieces(folder, list.stem().string(), extension, common);
  Steps steps(input, result);
  std::vector<std::pair<double, std::string>> files;
  for (std::size_t n = 0; n < result.times.size(); ++n) {
    const std::string piece = fmt::format("{}_{:04}{}", list.stem().string(), n, extension);
    const auto out = open_output((folder / piece).string(), extension, common, {o.input});
    write_step(steps.at(n), out->path());
    out->commit();
    files.emplace_back(result.times[n], (list.stem() / piece).string());
  }
  hexmesh::write_pvd(files, file->path());
  file->commit();
}

int run(const Options& o, const CommonOptions& common, const Console& console) {
  if (o.lattice.empty() && o.surface.empty() && o.csv.empty() && o.deck.empty())
    throw Error(ErrorKind::usage, "nothing to write, expected --lattice, --surface, --csv or --inp");
  if (!o.lattice.empty() && o.lattice == o.surface)
    throw Error(ErrorKind::usage, fmt::format("--lattice and --surface are both '{}', expected two names", o.lattice));
  const hexmesh::InputFile input(o.input);
  const Result result = read_input(o, input, console);
  warn_of_state(result, console);
  const hexmesh::Configuration configuration =
      o.deformed ? hexmesh::Configuration::deformed : hexmesh::Configuration::rest;
  const auto write = [&](const std::string& name, const char* extension, auto&& writer) {
    if (name.empty()) return;
    if (name != "-" && !name.ends_with(extension))
      throw Error(ErrorKind::usage, fmt::format("output '{}', expected a name that ends in {}", name, extension));
    const auto file = open_output(name, extension, common, {o.input});
    writer(file->path());
    file->commit();
    console.note(fmt::format("wrote {}", name == "-" ? "standard output" : name));
  };
  const auto write_steps = [&](const std::string& name, const char* extension, auto&& writer) {
    if (!name.ends_with(".pvd"))
      return write(name, extension, [&](const auto& path) { writer(result, configuration, path); });
    write_series(name, extension, result, o, input, common,
                 [&](const Result& step, const auto& path) { writer(step, configuration, path); });
    console.note(fmt::format("wrote {} and {} files beside it", name, result.times.size()));
  };
  write_steps(o.lattice, ".vtu", hexmesh::write_vtu);
  write_steps(o.surface, ".vtp", hexmesh::write_vtp);
  write(o.csv, ".csv", [&](const auto& path) { write_csv(result, path); });
  write(o.deck, ".inp", [&](const auto& path) { write_deck(result, path); });
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  auto o = std::make_shared<Options>();
  return run_tool(
      argc, argv,
      {"hexexport", "Export a result, or a lattice before anything is solved, to the files that ParaView opens.",
       "hexexport liver.hexresult --lattice liver.vtu --surface liver.vtp",
       [o](CLI::App& app, const CommonOptions& common, const Console& console) -> std::function<int()> {
         app.add_option("input", o->input, "Result file of hexsolve or lattice file of hexmesh; - is standard input")
             ->required();
         app.add_option("--level", o->level, "Level of a lattice file to export; 0 = voxels [default: 0]")
             ->check(CLI::Range(0, 30));
         app.add_option("--lattice", o->lattice,
                        "Hexahedra (.vtu; .pvd: the steps of a motion): displacement, fill, parts, segment, "
                        "strain_energy_density [N/mm^2]");
         app.add_option("--surface", o->surface,
                        "Embedded surface (.vtp; .pvd: the steps of a motion): displacement, segment");
         app.add_option("--csv", o->csv, "node,x,y,z,ux,uy,uz [mm, LPS] of the lattice nodes (.csv)");
         app.add_option("--inp", o->deck,
                        "The same model as a CalculiX deck (.inp), for comparison: level 0, strain = \"cauchy\", "
                        "volumetric = \"full\", conditions on = \"nodes\"");
         app.add_flag("--deformed", o->deformed,
                      "Move the points; by default files hold the rest shape with the displacement as data");
         return [=, &common, &console] { return run(*o, common, console); };
       }});
}
