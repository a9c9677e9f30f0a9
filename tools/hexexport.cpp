// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "cli/checksum.h"
#include "cli/result_state.h"
#include "hexexport/deck.h"
#include "hexexport/html_report.h"
#include "hexexport/tables.h"
#include "hexexport/volumes.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/lattice_file.h"
#include "hexmesh/file/result_file.h"
#include "hexmesh/file/vtkhdf.h"
#include "hexmesh/surface/surface_file.h"
#include "hexmesh/view/obstacle.h"
#include "hexmesh/view/vtk_export.h"
#include "hexmesh/warp/extension.h"

namespace {

using namespace hextools;
using hexmesh::Configuration;
using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Result;
using std::filesystem::path;

/// A result, or a level of a lattice file at rest.
Result read_input(const ExportOptions& o, const Input& input, const Console& console) {
  if (hexmesh::format_of(input.path()) == hexmesh::result_format) {
    if (o.level >= 0) throw Error(ErrorKind::usage, "--level goes with a lattice file, but the input is a result");
    return o.shows_surface() ? read_with_surface(input.path()) : hexmesh::read_result(input.path());
  }
  if (o.needs_a_result())
    throw Error(ErrorKind::usage,
                "the input is a lattice file, expected a result for all but --lattice and --surface at rest");
  const int count = static_cast<int>(hexmesh::cells_of_levels(input.path()).size());
  const int level = std::max(o.level, 0);
  if (level >= count) throw Error(ErrorKind::input, fmt::format("level is {}, expected 0 to {}", level, count - 1));
  console.note(fmt::format("level {} of 0 to {}", level, count - 1));
  return hexmesh::rest_state(hexmesh::read_lattice(input.path(), {level}), level);
}

/// As people look at it: nodes beyond the material follow it, and slivers do not set the scale of stresses; what was
/// solved goes along as *_raw.
Result to_look_at(const Result& result, const hexmesh::NodeExtension& extension) {
  Result out = result;
  if (extension.is_empty()) return out;
  out.displacement_raw = result.displacement;
  out.displacement = extension.extended(std::move(out.displacement));
  out.velocity = extension.extended(std::move(out.velocity));
  out.rest_displacement = extension.extended(std::move(out.rest_displacement));
  for (const char* name : {"von_mises_stress", "pressure", "strain_energy_density"})
    if (const auto field = result.cell_fields.find(name); field != result.cell_fields.end()) {
      out.cell_fields[std::string(name) + "_raw"] = field->second;
      out.cell_fields[name] = extension.without_slivers(field->second);
    }
  return out;
}

void write_lattice(const Result& result, Configuration configuration, const path& file) {
  if (file.extension() == ".hdf")
    hexmesh::write_vtkhdf(result, configuration == Configuration::deformed, file);
  else
    hexmesh::write_vtu(result, configuration, file);
}

/// Formats that hold no displacement hold the deformed shape.
void write_surface(const Result& result, Configuration configuration, const path& file) {
  if (file.extension() == ".vtp") return hexmesh::write_vtp(result, configuration, file);
  hexmesh::TriangleSurface surface = result.surface;
  for (std::size_t n = 0; n < result.surface_displacement.size(); ++n)
    surface.points[n] += result.surface_displacement[n];
  hexmesh::write_surface(surface, file);
}

/// The command that makes the report, with what it reads.
std::string made_by(const Input& input, const Input* scan) {
  std::vector<std::string> read = {checksum_line(input.name(), input.path())};
  if (scan) read.push_back(checksum_line(scan->name(), scan->path()));
  return history_entry(read);
}

/// @param input, scan, grid  the last two may be nullptr
void write_all(const ExportOptions& o, const Result& result, const Input& input, const Input* scan_file,
               const Input* grid, const OutputWriter& out, const Console& console) {
  const Configuration configuration = o.deformed ? Configuration::deformed : Configuration::rest;
  std::optional<hexmesh::NodeExtension> extension;
  if (!o.lattice.empty()) extension.emplace(result);
  out.write_steps(o.lattice, result, input.path(), [&](const Result& step, const path& file) {
    write_lattice(to_look_at(step, *extension), configuration, file);
  });
  out.write_steps(o.surface, result, input.path(),
                  [&](const Result& step, const path& file) { write_surface(step, configuration, file); });
  out.write(o.conditions, [&](const path& file) {
    hexmesh::write_conditions_vtp(result, condition_forces(result), configuration, file);
  });
  out.write(o.obstacles, [&](const path& file) {
    const std::vector<hexmesh::Obstacle> obstacles = obstacles_of(result);
    if (obstacles.empty())
      throw Error(ErrorKind::usage, "the scene of the result has no obstacles, expected some for --obstacles");
    hexmesh::write_obstacles_vtp(obstacles, hexmesh::bounds_of(result), file);
  });
  out.write_text(o.csv, [&] { return nodes_csv(result); });
  out.write(o.deck, [&](const path& file) { write_deck(result, file); });
  out.write_text(o.report, [&] { return o.report.ends_with(".csv") ? report_csv(result) : report_json(result); });
  ScanOfResult scan(scan_file, result, console);
  write_volumes(o, result, scan, grid, out, console);
  out.write_text(o.html, [&] { return html_report(result, scan.get(), made_by(input, scan_file)); });
}

int run(const ExportOptions& o, const CommonOptions& common, const Console& console) {
  check_options(o);
  RunFiles files(common);
  const Input& input = files.input(o.input);
  const Input* scan = files.input_if_named(o.scan);
  const Input* grid = o.grid == "fitted" ? nullptr : files.input_if_named(o.grid);
  const std::vector<Probe> probes = read_probes(o.probes, files);
  Output* table = o.probes.empty() ? nullptr : &files.output("-", Content::text);
  const Result result = read_input(o, input, console);
  if (is_preview(result) && o.needs_a_solution())
    throw Error(ErrorKind::usage,
                "the result shows a scene that is not solved, expected a solution for all but --lattice, --surface, "
                "--conditions, --obstacles and --report");
  OutputWriter out(o, result.times.size(), files, common);
  warn_of_state(result, console);
  if (table) table->write(probe_table(input.path(), result, probes));
  write_all(o, result, input, scan, grid, out, console);
  out.commit(console);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  auto o = std::make_shared<ExportOptions>();
  return run_tool(
      argc, argv,
      {"hexexport", "Export a result, or a lattice before anything is solved, to the files that other programs open.",
       "hexexport liver.hexresult --lattice liver.vtu --surface liver.vtp --html liver.html --scan ct.nrrd",
       [o](CLI::App& app, const CommonOptions& common, const Console& console) -> std::function<int()> {
         add_options(app, *o);
         return [=, &common, &console] { return run(*o, common, console); };
       }});
}
