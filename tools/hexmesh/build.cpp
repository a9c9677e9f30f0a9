// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <omp.h>

#include <nlohmann/json.hpp>

#include "cli/checksum.h"
#include "cli/json_text.h"
#include "cli/machine.h"
#include "cli/parse.h"
#include "cli/progress.h"
#include "cli/run_files.h"
#include "commands.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/lattice_file.h"
#include "hexmesh/scan/image_io.h"
#include "hexmesh/volume/resample.h"
#include "lattice_report.h"
#include "material_choices.h"
#include "segments/segment_reader.h"
#include "surface_maker.h"

namespace hextools {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Lattice;
using nlohmann::json;

BuildInputs inputs_of(const BuildOptions& o, RunFiles& files) {
  BuildInputs inputs{files.input_if_named(o.materials_file, Content::text), files.input_if_named(o.intensity), {}};
  for (const std::string& text : o.embedded) {
    const auto [segment, file] = parse_pair("--embed", text, "SEGMENT=FILE");
    inputs.embedded.emplace_back(segment, &files.input(file));
  }
  return inputs;
}

hexmesh::LabelVolume read_voxels(const BuildOptions& o, const SegmentReader& segments, Notes& notes,
                                 std::vector<std::string>& read) {
  for (const Input* file : segments.files()) read.push_back(checksum_line(file->name(), file->path()));
  hexmesh::LabelVolume labels = segments.read();
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

/// What cells are to keep apart.
hexmesh::Parting parting_of(const BuildOptions& o, const std::vector<hexmesh::LatticeSegment>& segments) {
  hexmesh::Parting out;
  out.gaps = o.gaps == "split";
  const auto label_of = [&](const std::string& name) {
    const hexmesh::LatticeSegment& segment = hexmesh::segment_named(segments, name);
    if (!segment.material)
      throw Error(ErrorKind::input,
                  fmt::format("--slide names '{}', which has no material, expected one that is solved "
                              "on",
                              name));
    return segment.segment.label;
  };
  for (const auto& [one, other] : o.sliding) {
    out.sliding.emplace_back(label_of(one), label_of(other));
    if (out.sliding.back().first == out.sliding.back().second)
      throw Error(ErrorKind::usage, fmt::format("--slide names '{}' twice, expected two segments", one));
  }
  return out;
}

Lattice build(const BuildOptions& o, const BuildInputs& inputs, SegmentReader& segments, Notes& notes,
              std::vector<std::string>& read) {
  const auto choices = material_choices(o, inputs.materials, read);
  std::optional<hexmesh::IntensityVolume> intensity;
  if (inputs.intensity) {
    read.push_back(checksum_line(inputs.intensity->name(), inputs.intensity->path()));
    std::optional<hexmesh::Grid> stored;
    intensity = hexmesh::read_intensity(inputs.intensity->path(), segments.options(), &stored);
    segments.set_reference(stored);
  }
  const hexmesh::LabelVolume labels = read_voxels(o, segments, notes, read);
  hexmesh::AssignedMaterials materials = hexmesh::assign_materials(labels, choices);
  notes.insert(notes.end(), materials.notes.begin(), materials.notes.end());
  hexmesh::LatticeOptions options = o.lattice;
  options.parting = parting_of(o, materials.segments);
  if (materials.rules.empty()) {
    if (inputs.intensity && !segments.has_dicom())
      throw Error(ErrorKind::usage,
                  "--intensity is given but no material follows the grey values, expected a law in "
                  "--materials");
    at_work("building the levels");
    return hexmesh::build_lattice(labels, std::move(materials.segments), options);
  }
  if (!intensity) throw Error(ErrorKind::usage, "a material follows the grey values, expected --intensity SCAN");
  const hexmesh::GreyMaterials grey{&*intensity, std::move(materials.rules)};
  at_work("building the levels");
  return hexmesh::build_lattice(labels, std::move(materials.segments), options, &grey);
}

int level_of_size(const Lattice& lattice, double cell_size) {
  for (int n = 0; n < static_cast<int>(lattice.levels.size()); ++n)
    if ((lattice.cell_size(n).array() / cell_size - 1).abs().maxCoeff() < 1e-9) return n;
  throw Error(ErrorKind::geometry, fmt::format("no level has cells of {:g} mm, expected more levels (--levels) or a "
                                               "smaller cell",
                                               cell_size));
}

hexmesh::MatrixStorage storage_named(const std::string& name) {
  if (name == "all") return hexmesh::MatrixStorage::all;
  return name == "none" ? hexmesh::MatrixStorage::none : hexmesh::MatrixStorage::automatic;
}

int run_build(const BuildOptions& o, const CommonOptions& common, const Console& console) {
  const double start = omp_get_wtime();
  RunFiles files(common);
  SegmentReader segments(o.segments, files, console);
  const BuildInputs inputs = inputs_of(o, files);
  Output& output = files.output(o.output, Content::binary, ".hexmesh");
  Output* report_file = files.output_if_named(o.report, Content::text, ".json");
  Notes notes;
  std::vector<std::string> read;  // checksum lines
  Lattice lattice = build(o, inputs, segments, notes, read);
  if (o.cell_size > 0)
    notes.push_back(fmt::format("level {} has cells of {:g} mm", level_of_size(lattice, o.cell_size), o.cell_size));
  const double levels_done = omp_get_wtime();
  at_work("finding the surface");
  const SurfaceMaker surfaces(o, inputs, lattice);
  lattice.surface = surfaces.make(notes);
  lattice.surface_of_voxels = surfaces.all_of_voxels();
  for (const auto& [segment, file] : inputs.embedded) read.push_back(checksum_line(file->name(), file->path()));
  const double surfaces_done = omp_get_wtime();
  lattice.history.push_back(history_entry(read));
  hexmesh::write_lattice(lattice, output.path(), storage_named(o.matrices));
  json report = describe(lattice, hexmesh::levels_with_matrices(output.path()));
  output.prepare();

  report["seconds"] = {{"levels", levels_done - start},
                       {"surfaces", surfaces_done - levels_done},
                       {"write", omp_get_wtime() - surfaces_done},
                       {"total", omp_get_wtime() - start}};
  report["peak_memory_mb"] = peak_memory_mb();
  if (report_file) report_file->write(json_text(report));
  files.commit();
  for (const std::string& line : notes) console.note(line);
  console.note(fmt::format("{} levels in {:.2f} s, {:.0f} MB\n{}", lattice.levels.size(), omp_get_wtime() - start,
                           peak_memory_mb(), table(report)));
  if (o.gaps == "tie") note_joined(report, console);
  return 0;
}

}  // namespace

std::function<int()> declare_build(CLI::App& app, const CommonOptions& common, const Console& console) {
  const auto o = std::make_shared<BuildOptions>();
  add_segment_options(app, o->segments);
  add_repeated(
      app, "--material", o->materials,
      "SEGMENT:young_kpa=E,poisson=NU,density_kg_m3=RHO, SEGMENT:tissue=bone, or SEGMENT:none for one that only "
      "serves boundary conditions; SEGMENT * means all others. Without it the segment's name chooses a tissue");
  app.add_option("--materials", o->materials_file,
                 "Materials file (TOML): numbers, tissues, and laws that follow the grey values");
  app.add_option(
      "--intensity", o->intensity,
      "Scan whose grey values the laws of --materials follow, or that contours were drawn on (NRRD, NIfTI, MetaImage, "
      "DICOM folder)");
  app.add_option("--levels", o->lattice.num_levels, "Number of levels; 0 = until at most 16 cells are left")
      ->check(CLI::Range(0, 20))
      ->capture_default_str();
  app.add_option("--cell-size", o->cell_size,
                 "Edge of cubic cells that some level has exactly [mm]; the voxels are resampled once for "
                 "it. Without it nothing is resampled")
      ->check(CLI::PositiveNumber);
  app.add_option("--offset", o->lattice.offset, "i,j,k: shift of the lattice against the body [voxels]")
      ->delimiter(',')
      ->check(CLI::Range(0, 4096));
  app.add_option("--gaps", o->gaps,
                 "What cells do where gaps part the material in them: be several, one for each part, so that gaps open "
                 "at every level (split), or hold it together (tie)")
      ->check(CLI::IsMember({"tie", "split"}))
      ->capture_default_str();
  app.add_option("--slide", o->sliding,
                 "A B: segments that slide along each other: no cell holds them together; what they do where they "
                 "touch is the scene's [[contact]]. Repeatable")
      ->type_name("A B");
  app.add_option("--matrices", o->matrices,
                 "Which levels' element matrices the file holds: those that take at most 60 bytes a voxel (auto), all "
                 "above level 0, none")
      ->check(CLI::IsMember({"auto", "all", "none"}))
      ->capture_default_str();
  add_repeated(app, "--surface", o->surfaces, "SEGMENT=TRIANGLES: decimate the segment's picture surface; 0 = none");
  add_repeated(app, "--embed", o->embedded,
               "SEGMENT=FILE: picture surface from a file instead (.obj .stl .ply .off .vtp; LPS, mm)");
  app.add_option("--report", o->report, "Write a JSON report; - is standard output");
  add_output(app, o->output, "Lattice file (.hexmesh, HDF5)");
  return [o, &common, &console] { return run_build(*o, common, console); };
}

}  // namespace hextools
