// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <omp.h>

#include <charconv>
#include <nlohmann/json.hpp>

#include "cli/tool.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/lattice_file.h"
#include "hexmesh/scan/image_io.h"
#include "hexmesh/surface/extract.h"

namespace {

using namespace hextools;
using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Lattice;
using nlohmann::json;

struct Options {
  std::string input, output, report;
  std::vector<std::string> materials;
  hexmesh::LatticeOptions lattice;
  bool as_json = false;
};

double number_of(const std::string& text, const std::string& option) {
  double value = 0;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failed != std::errc() || end != text.data() + text.size())
    throw Error(ErrorKind::usage, fmt::format("--material '{}': '{}' is not a number", option, text));
  return value;
}

/// "liver:young_kpa=100,poisson=0.3,density_kg_m3=1060" or "vena_cava:none".
std::pair<std::string, hexmesh::MaterialChoice> parse_material(const std::string& option) {
  const std::size_t colon = option.rfind(':');
  if (colon == std::string::npos || colon == 0)
    throw Error(ErrorKind::usage,
                fmt::format("--material '{}', expected SEGMENT:key=value,... or SEGMENT:none", option));
  hexmesh::MaterialChoice choice;
  std::string rest = option.substr(colon + 1);
  if (rest == "none") {
    choice.none = true;
    return {option.substr(0, colon), choice};
  }
  while (!rest.empty()) {
    const std::size_t comma = rest.find(',');
    const std::string part = rest.substr(0, comma);
    rest = comma == std::string::npos ? "" : rest.substr(comma + 1);
    const std::size_t equals = part.find('=');
    const std::string key = part.substr(0, equals);
    const auto value = [&] { return number_of(equals == std::string::npos ? "" : part.substr(equals + 1), option); };
    if (key == "young_kpa")
      choice.young_kpa = value();
    else if (key == "poisson")
      choice.poisson = value();
    else if (key == "density_kg_m3")
      choice.density_kg_m3 = value();
    else
      throw Error(ErrorKind::usage, fmt::format("--material '{}': unknown key '{}', expected young_kpa, poisson, "
                                                "density_kg_m3",
                                                option, key));
  }
  return {option.substr(0, colon), choice};
}

json describe(const Lattice& lattice) {
  json report;
  for (std::size_t n = 0; n < lattice.levels.size(); ++n) {
    const hexmesh::Level& level = lattice.levels[n];
    const hexmesh::Vec3 size = lattice.cell_size(static_cast<int>(n));
    std::size_t boundary = 0;
    for (const std::int32_t e : level.element)
      boundary += level.elements[static_cast<std::size_t>(e)].volume() < size.prod() * (1 - 1e-9);
    report["levels"].push_back({{"level", n},
                                {"cells", level.cells.size()},
                                {"boundary_cells", boundary},
                                {"unique_matrices", level.elements.size()},
                                {"cell_mm", {size[0], size[1], size[2]}}});
  }
  const double voxel_ml = lattice.voxels.voxel_volume() / 1000;
  for (const hexmesh::LatticeSegment& s : lattice.segments) {
    const double volume = static_cast<double>(s.num_voxels) * voxel_ml;
    json entry = {{"name", s.segment.name}, {"label", s.segment.label}, {"volume_ml", volume}};
    if (s.material) {
      entry["young_kpa"] = s.material->young * 1e3;
      entry["poisson"] = s.material->poisson;
      entry["density_kg_m3"] = s.material->density * 1e12;
      entry["mass_g"] = volume * 1e3 * s.material->density * 1e6;
    }
    report["segments"].push_back(entry);
  }
  const hexmesh::Vec3& spacing = lattice.voxels.spacing();
  report["voxel_mm"] = {spacing[0], spacing[1], spacing[2]};
  report["surface"] = {{"points", lattice.surface.points.size()}, {"triangles", lattice.surface.triangles.size()}};
  report["history"] = lattice.history;
  return report;
}

std::string table(const json& report) {
  std::string out = fmt::format("{:<6}{:>12}{:>12}{:>10}   cell [mm]\n", "level", "cells", "boundary", "unique");
  for (const json& l : report["levels"])
    out += fmt::format("{:<6}{:>12}{:>12}{:>10}   {:.3g} x {:.3g} x {:.3g}\n", l["level"].get<int>(),
                       l["cells"].get<std::size_t>(), l["boundary_cells"].get<std::size_t>(),
                       l["unique_matrices"].get<std::size_t>(), l["cell_mm"][0].get<double>(),
                       l["cell_mm"][1].get<double>(), l["cell_mm"][2].get<double>());
  for (const json& s : report["segments"]) {
    out += fmt::format("segment {} '{}': {:.1f} mL", s["label"].get<int>(), s["name"].get<std::string>(),
                       s["volume_ml"].get<double>());
    if (s.contains("young_kpa"))
      out += fmt::format(", E {:g} kPa, nu {:g}, {:.1f} g\n", s["young_kpa"].get<double>(), s["poisson"].get<double>(),
                         s["mass_g"].get<double>());
    else
      out += ", no material\n";
  }
  return out;
}

int run_build(const Options& o, const CommonOptions& common, const Console& console) {
  const double start = omp_get_wtime();
  std::map<std::string, hexmesh::MaterialChoice> choices;
  for (const std::string& option : o.materials)
    if (!choices.insert(parse_material(option)).second)
      throw Error(ErrorKind::usage, fmt::format("--material '{}': the segment has one already", option));
  const auto output = open_output(o.output, "", common, {o.input});
  Lattice lattice = [&] {
    const hexmesh::InputFile file(o.input);
    const hexmesh::LabelVolume labels = hexmesh::read_labels(file.path());
    std::vector<std::string> notes;
    std::vector<hexmesh::LatticeSegment> segments = hexmesh::assign_materials(labels, choices, notes);
    for (const std::string& line : notes) console.note(line);
    return hexmesh::build_lattice(labels, std::move(segments), o.lattice);
  }();
  const double levels_done = omp_get_wtime();
  lattice.surface = hexmesh::extract_surface(lattice);
  lattice.history.push_back(command_line());
  hexmesh::write_lattice(lattice, output->path());
  output->commit();

  json report = describe(lattice);
  report["seconds"] = {{"levels", levels_done - start}, {"total", omp_get_wtime() - start}};
  report["peak_memory_mb"] = peak_memory_mb();
  console.note(fmt::format("{} levels in {:.2f} s, {:.0f} MB\n{}", lattice.levels.size(), omp_get_wtime() - start,
                           peak_memory_mb(), table(report)));
  if (!o.report.empty()) write_text(o.report, report.dump(2) + "\n", common);
  return 0;
}

int run_info(const Options& o) {
  const hexmesh::InputFile file(o.input);
  const json report = describe(hexmesh::read_lattice(file.path()));
  fmt::print("{}", o.as_json ? report.dump(2) + "\n" : table(report));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  auto o = std::make_shared<Options>();
  return run_tool(
      argc, argv,
      {"hexmesh", "Build the multi-resolution lattice of a labelled volume, or look at one.",
       "hexmesh build liver.nrrd --material liver:young_kpa=100,poisson=0.3 -o liver.hexmesh",
       [o](CLI::App& app, const CommonOptions& common, const Console& console) -> std::function<int()> {
         app.require_subcommand(1);
         CLI::App* build = app.add_subcommand("build", "Labelled volume -> lattice (HDF5)");
         build->add_option("labels", o->input, "Labelled volume (NRRD, NIfTI, MetaImage); - is standard input")
             ->required();
         build->add_option(
             "--material", o->materials,
             "SEGMENT:young_kpa=E,poisson=NU,density_kg_m3=RHO, or SEGMENT:none for one that only serves "
             "boundary conditions; SEGMENT * means all others. Without it the segment's name chooses a tissue");
         build->add_option("--levels", o->lattice.num_levels, "Number of levels; 0 = until at most 16 cells are left")
             ->check(CLI::Range(0, 20))
             ->capture_default_str();
         build->add_option("--offset", o->lattice.offset, "i,j,k: shift of the lattice against the body [voxels]")
             ->delimiter(',')
             ->check(CLI::Range(0, 4096));
         build->add_option("--report", o->report, "Write a JSON report; - is standard output");
         add_output(*build, o->output, "Lattice file (.hexmesh, HDF5)");
         CLI::App* info = app.add_subcommand("info", "Levels, segments and materials of a lattice file");
         info->add_option("lattice", o->input, "Lattice file; - is standard input")->required();
         info->add_flag("--json", o->as_json, "As JSON");
         return [=, &common, &console] { return build->parsed() ? run_build(*o, common, console) : run_info(*o); };
       }});
}
