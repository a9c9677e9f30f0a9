// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <omp.h>

#include <charconv>
#include <nlohmann/json.hpp>

#include "cli/checksum.h"
#include "cli/lattice_report.h"
#include "cli/tool.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/lattice_file.h"
#include "hexmesh/file/material_file.h"
#include "hexmesh/lattice/assign.h"
#include "hexmesh/lattice/check.h"
#include "hexmesh/lattice/locator.h"
#include "hexmesh/scan/image_io.h"
#include "hexmesh/scan/resample.h"
#include "hexmesh/surface/decimate.h"
#include "hexmesh/surface/extract.h"
#include "hexmesh/surface/surface_file.h"

namespace {

using namespace hextools;
using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Lattice;
using nlohmann::json;

struct Options {
  std::string input, output, report, materials_file, intensity, segment;
  std::vector<std::string> materials, surfaces, embedded;
  hexmesh::LatticeOptions lattice;
  double cell_size = 0;
  bool as_json = false;
};

using Notes = std::vector<std::string>;  ///< said once all went well

/// "NAME=VALUE" as `option` takes it.
std::pair<std::string, std::string> parse_pair(const std::string& text, const char* option, const char* value) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
    throw Error(ErrorKind::usage, fmt::format("{} '{}', expected SEGMENT={}", option, text, value));
  return {text.substr(0, equals), text.substr(equals + 1)};
}

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

std::map<std::string, hexmesh::MaterialChoice> material_choices(const Options& o, std::vector<std::string>& read) {
  std::map<std::string, hexmesh::MaterialChoice> choices;
  if (!o.materials_file.empty()) {
    const hexmesh::InputFile file(o.materials_file);
    read.push_back(checksum_line(o.materials_file, file.path()));
    choices = hexmesh::read_materials(file.path(), o.materials_file);
  }
  for (const std::string& option : o.materials)
    if (!choices.insert(parse_material(option)).second)
      throw Error(ErrorKind::usage, fmt::format("--material '{}': the segment has one already", option));
  return choices;
}

/// The surface to show of each segment with material: one of the user's, one from the voxels with as many triangles as
/// asked for, or none.
class SurfaceMaker {
public:
  SurfaceMaker(const Options& o, const Lattice& lattice) : lattice_(lattice) {
    for (const std::string& text : o.surfaces) {
      const auto [name, value] = parse_pair(text, "--surface", "TRIANGLES");
      std::size_t count = 0;
      const auto [end, failed] = std::from_chars(value.data(), value.data() + value.size(), count);
      if (failed != std::errc() || end != value.data() + value.size())
        throw Error(ErrorKind::usage, fmt::format("--surface '{}': '{}' is not a number of triangles", text, value));
      triangles_[label_of(name)] = count;
    }
    for (const std::string& text : o.embedded) {
      const auto [name, file] = parse_pair(text, "--embed", "FILE");
      files_[label_of(name)].push_back(file);
    }
  }

  hexmesh::TriangleSurface make(Notes& notes) const {
    hexmesh::TriangleSurface all;
    for (const hexmesh::LatticeSegment& s : lattice_.segments) {
      const std::uint16_t label = s.segment.label;
      if (const auto files = files_.find(label); files != files_.end())
        for (const std::string& file : files->second) append(all, embedded(file, label));
      else if (s.material)
        append(all, extracted(s, notes));
    }
    return all;
  }

private:
  std::uint16_t label_of(const std::string& name) const {
    return hexmesh::segment_named(lattice_.segments, name).segment.label;
  }

  hexmesh::TriangleSurface extracted(const hexmesh::LatticeSegment& s, Notes& notes) const {
    const auto wanted = triangles_.find(s.segment.label);
    if (wanted != triangles_.end() && wanted->second == 0) return {};
    hexmesh::TriangleSurface surface = hexmesh::extract_surface(lattice_, s.segment.label);
    if (wanted == triangles_.end()) return surface;
    surface = hexmesh::decimate(surface, wanted->second);
    const std::size_t crossing = hexmesh::count_self_intersections(surface);
    if (crossing > 0)
      notes.push_back(
          fmt::format("warning: surface of '{}' with {} triangles crosses itself in {} pairs of triangles; more "
                      "triangles may help",
                      s.segment.name, surface.triangles.size(), crossing));
    return surface;
  }

  hexmesh::TriangleSurface embedded(const std::string& file, std::uint16_t label) const {
    hexmesh::TriangleSurface surface = hexmesh::read_surface(file);
    surface.segment.assign(surface.triangles.size(), label);
    const hexmesh::CellLocator locator(lattice_.voxels, {1, 1, 1}, lattice_.levels.front().cells);
    for (const hexmesh::Vec3& p : surface.points)
      if (locator.locate_position(p).cell < 0)
        throw Error(ErrorKind::geometry,
                    fmt::format("surface '{}' has a point at ({:.1f}, {:.1f}, {:.1f}) mm, more than {} mm from the "
                                "material, expected a surface of this body in LPS and mm",
                                file, p[0], p[1], p[2], hexmesh::embedding_reach));
    return surface;
  }

  const Lattice& lattice_;
  std::map<std::uint16_t, std::size_t> triangles_;
  std::map<std::uint16_t, std::vector<std::string>> files_;
};

hexmesh::LabelVolume read_voxels(const Options& o, Notes& notes, std::vector<std::string>& read,
                                 const Console& console) {
  const hexmesh::InputFile file(o.input);
  read.push_back(checksum_line(o.input, file.path()));
  hexmesh::LabelVolume labels = hexmesh::read_labels(file.path(), {.warn = warning_on(console)});
  if (o.cell_size == 0) return labels;
  const auto volume = [](const hexmesh::LabelVolume& v) {
    std::size_t count = 0;
    for (const std::size_t n : hexmesh::count_voxels(v)) count += n;
    return static_cast<double>(count) * v.grid.voxel_volume() / 1000;
  };
  const double before = volume(labels);
  labels = hexmesh::resample_for_cells(labels, o.cell_size);
  const hexmesh::Vec3& s = labels.grid.spacing();
  notes.push_back(
      fmt::format("resampled to voxels of {:.4g} x {:.4g} x {:.4g} mm for cells of {:g} mm: {:.2f} mL of "
                  "{:.2f} mL",
                  s[0], s[1], s[2], o.cell_size, volume(labels), before));
  return labels;
}

Lattice build(const Options& o, Notes& notes, std::vector<std::string>& read, const Console& console) {
  const auto choices = material_choices(o, read);
  const hexmesh::LabelVolume labels = read_voxels(o, notes, read, console);
  hexmesh::AssignedMaterials materials = hexmesh::assign_materials(labels, choices);
  notes.insert(notes.end(), materials.notes.begin(), materials.notes.end());
  if (materials.rules.empty()) {
    if (!o.intensity.empty())
      throw Error(ErrorKind::usage,
                  "--intensity is given but no material follows the grey values, expected a law in "
                  "--materials");
    return hexmesh::build_lattice(labels, std::move(materials.segments), o.lattice);
  }
  if (o.intensity.empty())
    throw Error(ErrorKind::usage, "a material follows the grey values, expected --intensity SCAN");
  const hexmesh::InputFile file(o.intensity);
  read.push_back(checksum_line(o.intensity, file.path()));
  const hexmesh::IntensityVolume intensity = hexmesh::read_intensity(file.path(), {.warn = warning_on(console)});
  const hexmesh::GreyMaterials grey{&intensity, std::move(materials.rules)};
  return hexmesh::build_lattice(labels, std::move(materials.segments), o.lattice, &grey);
}

int level_of_size(const Lattice& lattice, double cell_size) {
  for (int n = 0; n < static_cast<int>(lattice.levels.size()); ++n)
    if ((lattice.cell_size(n).array() / cell_size - 1).abs().maxCoeff() < 1e-9) return n;
  throw Error(ErrorKind::geometry, fmt::format("no level has cells of {:g} mm, expected more levels (--levels) or a "
                                               "smaller cell",
                                               cell_size));
}

int run_build(const Options& o, const CommonOptions& common, const Console& console) {
  const double start = omp_get_wtime();
  std::vector<std::string> inputs = {o.input, o.materials_file, o.intensity};
  for (const std::string& text : o.embedded) inputs.push_back(text.substr(text.find('=') + 1));
  const auto output = open_output(o.output, "", common, inputs);
  Notes notes;
  std::vector<std::string> read;  // checksum lines
  Lattice lattice = build(o, notes, read, console);
  if (o.cell_size > 0)
    notes.push_back(fmt::format("level {} has cells of {:g} mm", level_of_size(lattice, o.cell_size), o.cell_size));
  const double levels_done = omp_get_wtime();
  lattice.surface = SurfaceMaker(o, lattice).make(notes);
  for (const std::string& text : o.embedded) {
    const std::string file = parse_pair(text, "--embed", "FILE").second;
    read.push_back(checksum_line(file, file));
  }
  const double surfaces_done = omp_get_wtime();
  lattice.history.push_back(history_entry(read));
  hexmesh::write_lattice(lattice, output->path());
  output->commit();

  json report = describe(lattice);
  report["seconds"] = {{"levels", levels_done - start},
                       {"surfaces", surfaces_done - levels_done},
                       {"write", omp_get_wtime() - surfaces_done},
                       {"total", omp_get_wtime() - start}};
  report["peak_memory_mb"] = peak_memory_mb();
  for (const std::string& line : notes) console.note(line);
  console.note(fmt::format("{} levels in {:.2f} s, {:.0f} MB\n{}", lattice.levels.size(), omp_get_wtime() - start,
                           peak_memory_mb(), table(report)));
  note_joined(report, console);
  if (!o.report.empty()) write_text(o.report, report.dump(2) + "\n", common);
  return 0;
}

int run_info(const Options& o) {
  const hexmesh::InputFile file(o.input);
  const json report = describe(hexmesh::read_lattice(file.path()));
  fmt::print("{}", o.as_json ? report.dump(2) + "\n" : table(report));
  return 0;
}

int run_check(const Options& o) {
  const hexmesh::InputFile file(o.input);
  const Lattice lattice = hexmesh::read_lattice(file.path());
  std::vector<hexmesh::Finding> findings = hexmesh::check_lattice(lattice);
  findings.push_back(
      {"stored matrices are those of the voxels", 0, hexmesh::stored_matrix_error(file.path(), lattice), 1e-12});
  json report = json::array();
  std::string text = fmt::format("{:<44}{:>6}{:>12}{:>10}\n", "property", "level", "error", "limit");
  std::vector<std::string> broken;
  for (const hexmesh::Finding& f : findings) {
    report.push_back(
        {{"property", f.property}, {"level", f.level}, {"error", f.error}, {"limit", f.limit}, {"holds", f.holds()}});
    text += fmt::format("{:<44}{:>6}{:>12.1e}{:>10.0e}{}\n", f.property, f.level, f.error, f.limit,
                        f.holds() ? "" : "   BROKEN");
    if (!f.holds()) broken.push_back(fmt::format("'{}' at level {}", f.property, f.level));
  }
  fmt::print("{}", o.as_json ? report.dump(2) + "\n" : text);
  if (!broken.empty())
    throw Error(ErrorKind::input, fmt::format("lattice file '{}' breaks {} of {} properties: {}, expected none",
                                              o.input, broken.size(), findings.size(), fmt::join(broken, ", ")));
  return 0;
}

int run_surface(const Options& o, const CommonOptions& common) {
  const std::string ending = std::filesystem::path(o.output).extension();
  if (ending != ".obj" && ending != ".stl" && ending != ".ply" && ending != ".off")
    throw Error(ErrorKind::usage,
                fmt::format("output '{}', expected a name that ends in .obj, .stl, .ply or .off", o.output));
  const auto output = open_output(o.output, ending, common, {o.input});
  const hexmesh::InputFile file(o.input);
  const Lattice lattice = hexmesh::read_lattice(file.path(), {-1});
  hexmesh::TriangleSurface surface = lattice.surface;
  if (!o.segment.empty())
    surface = hexmesh::of_segment(surface, hexmesh::segment_named(lattice.segments, o.segment).segment.label);
  if (surface.triangles.empty())
    throw Error(ErrorKind::input, fmt::format("lattice file '{}' has no such surface, expected one", o.input));
  hexmesh::write_surface(surface, output->path());
  output->commit();
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
         add_repeated(
             *build, "--material", o->materials,
             "SEGMENT:young_kpa=E,poisson=NU,density_kg_m3=RHO, or SEGMENT:none for one that only serves "
             "boundary conditions; SEGMENT * means all others. Without it the segment's name chooses a tissue");
         build->add_option("--materials", o->materials_file,
                           "Materials file (TOML): numbers, tissues, and laws that follow the grey values");
         build->add_option("--intensity", o->intensity,
                           "Scan whose grey values the laws of --materials follow (NRRD, NIfTI, MetaImage)");
         build->add_option("--levels", o->lattice.num_levels, "Number of levels; 0 = until at most 16 cells are left")
             ->check(CLI::Range(0, 20))
             ->capture_default_str();
         build
             ->add_option("--cell-size", o->cell_size,
                          "Edge of cubic cells that some level has exactly [mm]; the voxels are resampled once for "
                          "it. Without it nothing is resampled")
             ->check(CLI::PositiveNumber);
         build->add_option("--offset", o->lattice.offset, "i,j,k: shift of the lattice against the body [voxels]")
             ->delimiter(',')
             ->check(CLI::Range(0, 4096));
         add_repeated(*build, "--surface", o->surfaces,
                      "SEGMENT=TRIANGLES: decimate the segment's picture surface; 0 = none");
         add_repeated(*build, "--embed", o->embedded,
                      "SEGMENT=FILE: picture surface from a file instead (.obj .stl .ply .off .vtp; LPS, mm)");
         build->add_option("--report", o->report, "Write a JSON report; - is standard output");
         add_output(*build, o->output, "Lattice file (.hexmesh, HDF5)");
         const auto look = [&](const char* name, const char* what) {
           CLI::App* command = app.add_subcommand(name, what);
           command->add_option("lattice", o->input, "Lattice file; - is standard input")->required();
           return command;
         };
         CLI::App* info = look("info", "Levels, segments and materials of a lattice file");
         CLI::App* check = look("check", "Verify that a lattice file is what its voxels give; exit 3 if not");
         for (CLI::App* command : {info, check}) command->add_flag("--json", o->as_json, "As JSON");
         CLI::App* surface = look("surface", "Write the embedded surfaces (.obj .stl .ply .off; .vtp: hexexport)");
         surface->add_option("--segment", o->segment, "Only the surface of this segment");
         surface->add_option("-o,--output", o->output, "Surface file")->required();
         return [=, &common, &console] {
           if (build->parsed()) return run_build(*o, common, console);
           if (surface->parsed()) return run_surface(*o, common);
           return check->parsed() ? run_check(*o) : run_info(*o);
         };
       }});
}
