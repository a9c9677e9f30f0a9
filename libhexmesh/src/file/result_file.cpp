// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/file/result_file.h"

#include <fmt/format.h>

#include "hexmesh/file/temporary_file.h"
#include "result_checks.h"
#include "shared_groups.h"
#include "split_groups.h"

namespace hexmesh {
namespace {

constexpr const char* step_field_names = "/step_field_names";

std::string step_group(std::size_t number) { return fmt::format("/steps/{}", number); }

std::string field_name(const std::string& name) { return "/cell_fields/" + name; }

std::vector<std::string> names_of(const std::map<std::string, std::vector<double>>& fields) {
  std::vector<std::string> names;
  for (const auto& [name, values] : fields) names.push_back(name);
  return names;
}

}  // namespace

ResultWriter::ResultWriter(const std::filesystem::path& path)
    : path_(path), file_(std::make_unique<hdf5::Writer>(path)) {}
ResultWriter::~ResultWriter() = default;

void ResultWriter::add_step(double time, const MotionStep& state) {
  const std::string group = step_group(times_.size());
  hdf5::write_points(*file_, group + "/displacement", state.displacement);
  hdf5::write_points(*file_, group + "/velocity", state.velocity);
  if (!state.contact_force.empty()) hdf5::write_points(*file_, group + "/contact_force", state.contact_force);
  if (times_.empty()) file_->write(step_field_names, names_of(state.cell_fields));
  for (const auto& [name, values] : state.cell_fields) {
    const std::vector<float> single(values.begin(), values.end());
    file_->write<float>(group + field_name(name), single, {single.size()});
  }
  times_.push_back(time);
}

namespace {

void write_level(hdf5::Writer& file, const Result& result) {
  const std::int32_t level = result.level;
  file.attribute("/mesh", "level", std::span(&level, 1));
  file.attribute("/mesh", "voxels_per_cell", std::span<const std::int32_t>(result.voxels_per_cell));
}

/// What does not grow with the body.
void write_texts_and_conditions(hdf5::Writer& file, const Result& result) {
  file.write("/cell_field_names", names_of(result.cell_fields));

  std::vector<std::string> names;
  for (const ConditionPoints& c : result.conditions) {
    const std::string group = fmt::format("/conditions/{}", names.size());
    names.push_back(c.name);
    hdf5::write_points(file, group + "/points", c.points);
    hdf5::write_points(file, group + "/displacement", c.displacement);
    const std::array<std::int32_t, 3> axes = {c.axes[0], c.axes[1], c.axes[2]};
    file.attribute(group, "axes", std::span<const std::int32_t>(axes));
  }
  file.write("/condition_names", names);
  file.write("/report", std::vector<std::string>{result.report});
  if (!result.costs.empty()) file.write("/costs", std::vector<std::string>{result.costs});
}

/// Voxels and surface of a result that has them, as a lattice file has them: a result's file is the same to the last
/// byte wherever these come from. A surface that follows from the voxels is left out.
void write_own_voxels(const Result& result, const std::filesystem::path& path) {
  hdf5::Writer file(path);
  hdf5::write_voxels(file, result.voxels, result.labels);
  if (result.surface_of_voxels)
    hdf5::write_surface_of_voxels(file);
  else
    hdf5::write_surface(file, result.surface, false);
  file.close();
}

/// Header, segments, and voxels and surface as a lattice file has them, in no memory.
void write_start(hdf5::Writer& file, const Result& result, const std::filesystem::path& lattice) {
  const hdf5::Reader from(lattice, "lattice");
  hdf5::write_header(file, result_format, result_version, result.history);
  hdf5::write_segments(file, result.segments);
  file.copy(from, "/voxels/labels");
  hdf5::write_grid(file, hdf5::read_grid(from));
  if (hdf5::is_surface_of_voxels(from)) return hdf5::write_surface_of_voxels(file);
  hdf5::write_surface_origin(file, false);
  for (const char* name : {"/surface/points", "/surface/triangles", "/surface/segment"}) file.copy(from, name);
}

std::span<const double> values_of(const std::vector<Vec3>& points) {
  return {points.empty() ? nullptr : points.front().data(), 3 * points.size()};
}

}  // namespace

void ResultWriter::finish(const Result& result, const std::filesystem::path& lattice) {
  hdf5::Writer& file = *file_;
  if (lattice.empty()) {
    const TemporaryFile own(path_.parent_path(), "", path_.string());
    write_own_voxels(result, own.path());
    write_start(file, result, own.path());
  } else {
    write_start(file, result, lattice);
  }
  write_level(file, result);
  hdf5::write_cells(file, "/mesh/cells", result.cells);
  hdf5::write_parting(file, result.parting);
  hdf5::write_owners(file, "/mesh/split", result.owners);
  file.write<std::int32_t>("/mesh/cell_nodes", {result.cell_nodes.front().data(), 8 * result.cell_nodes.size()},
                           {result.cell_nodes.size(), 8});
  file.write<std::uint16_t>("/mesh/segment", result.segment, {result.segment.size()});
  hdf5::write_points(file, "/mesh/nodes", result.nodes);
  hdf5::write_points(file, "/displacement", result.displacement);
  hdf5::write_points(file, "/velocity", result.velocity);
  if (!result.rest_displacement.empty()) hdf5::write_points(file, "/rest_displacement", result.rest_displacement);
  if (!result.load.empty()) hdf5::write_points(file, "/load", result.load);
  if (!result.contact_force.empty()) hdf5::write_points(file, "/contact_force", result.contact_force);
  file.write<double>("/times", times_, {times_.size()});

  for (const auto& [name, values] : result.cell_fields) file.write<double>(field_name(name), values, {values.size()});
  write_texts_and_conditions(file, result);
  file.close();
  file_.reset();  // only a file that is closed may be copied
}

void write_result(const Result& result, const std::filesystem::path& path, const std::filesystem::path& lattice) {
  ResultWriter(path).finish(result, lattice);
}

void begin_result(const Result& common, const std::filesystem::path& lattice, std::size_t num_cells,
                  std::size_t num_nodes, const std::filesystem::path& path) {
  hdf5::Writer file(path);
  write_start(file, common, lattice);
  write_level(file, common);
  hdf5::write_parting(file, common.parting);
  hdf5::write_owners(file, "/mesh/split", common.owners);
  file.declare<std::uint16_t>("/mesh/cells", {num_cells, 3});
  file.declare<std::int32_t>("/mesh/cell_nodes", {num_cells, 8});
  file.declare<std::uint16_t>("/mesh/segment", {num_cells});
  file.declare<double>("/mesh/nodes", {num_nodes, 3});
  file.declare<double>("/displacement", {num_nodes, 3});
  hdf5::write_points(file, "/velocity", {});
  file.write<double>("/times", {}, {0});
  for (const auto& [name, values] : common.cell_fields) file.declare<double>(field_name(name), {num_cells});
  write_texts_and_conditions(file, common);
  file.close();
}

void write_result_rows(const ResultRows& rows, const std::filesystem::path& path) {
  hdf5::Writer file(path, hdf5::Writer::Start::as_it_is);
  const Result& part = rows.part;
  const hsize_t cells = part.cells.size(), nodes = part.nodes.size();
  hdf5::write_cell_rows(file, "/mesh/cells", part.cells, rows.first_cell);
  file.write_rows<std::int32_t>("/mesh/cell_nodes",
                                {cells == 0 ? nullptr : part.cell_nodes.front().data(), 8 * part.cell_nodes.size()},
                                rows.first_cell, cells);
  file.write_rows<std::uint16_t>("/mesh/segment", part.segment, rows.first_cell, cells);
  for (const auto& [name, values] : part.cell_fields)
    file.write_rows<double>(field_name(name), values, rows.first_cell, cells);
  file.write_rows<double>("/mesh/nodes", values_of(part.nodes), rows.first_node, nodes);
  file.write_rows<double>("/displacement", values_of(part.displacement), rows.first_node, nodes);
  file.close();
}

namespace {

std::vector<CellNodes> read_cell_nodes(const hdf5::Reader& file, std::size_t num_cells, std::size_t num_nodes) {
  const auto nodes = file.read<std::int32_t>("/mesh/cell_nodes", {num_cells, 8});
  hdf5::check_range(file, "/mesh/cell_nodes", nodes, num_nodes);
  std::vector<CellNodes> out(num_cells);
  for (std::size_t n = 0; n < nodes.size(); ++n) out[n / 8][n % 8] = nodes[n];
  return out;
}

std::vector<ConditionPoints> read_conditions(const hdf5::Reader& file) {
  std::vector<ConditionPoints> out;
  for (const std::string& name : file.read_strings("/condition_names")) {
    const std::string group = fmt::format("/conditions/{}", out.size());
    std::vector<Vec3> points = hdf5::read_points(file, group + "/points");
    std::vector<Vec3> moved = hdf5::read_points(file, group + "/displacement", points.size());
    const auto axes = file.attribute<std::int32_t>(group, "axes", 3);
    for (const std::int32_t axis : axes)
      if (axis != 0 && axis != 1) file.fail(fmt::format("has {} in 'axes' of '{}', expected 0 or 1", axis, group));
    out.push_back({name, std::move(points), std::move(moved), {axes[0] != 0, axes[1] != 0, axes[2] != 0}});
  }
  return out;
}

/// The one text of a dataset.
std::string read_text(const hdf5::Reader& file, const std::string& name) {
  std::vector<std::string> texts = file.read_strings(name);
  if (texts.size() != 1) file.fail(fmt::format("has {} texts in '{}', expected 1", texts.size(), name));
  return std::move(texts.front());
}

}  // namespace

Result read_result(const std::filesystem::path& path) {
  const hdf5::Reader file(path, "result");
  std::vector<std::string> history = hdf5::read_header(file, result_format, result_version);
  const Grid voxels = hdf5::read_grid(file);
  Result r{voxels, {}, hdf5::read_segments(file, voxels)};
  r.history = std::move(history);
  r.level = file.attribute<std::int32_t>("/mesh", "level", 1)[0];
  r.voxels_per_cell = hdf5::read_index(file, "/mesh", "voxels_per_cell");
  r.parting = hdf5::read_parting(file, r.segments);
  r.cells = hdf5::read_cells(file, "/mesh/cells", coarser_extent(voxels.extent(), r.voxels_per_cell), r.parting.any());
  r.owners = hdf5::read_owners(file, "/mesh/split", voxels, {"/mesh/cells", r.cells, r.voxels_per_cell});
  r.nodes = hdf5::read_points(file, "/mesh/nodes");
  r.cell_nodes = read_cell_nodes(file, r.cells.size(), r.nodes.size());
  r.displacement = hdf5::read_points(file, "/displacement", r.nodes.size());
  r.velocity = hdf5::read_points(file, "/velocity");
  if (!r.velocity.empty() && r.velocity.size() != r.nodes.size())
    file.fail(fmt::format("/velocity has {} rows, expected none or {}", r.velocity.size(), r.nodes.size()));
  if (file.has("/rest_displacement"))
    r.rest_displacement = hdf5::read_points(file, "/rest_displacement", r.nodes.size());
  if (file.has("/load")) r.load = hdf5::read_points(file, "/load", r.nodes.size());
  if (file.has("/contact_force")) r.contact_force = hdf5::read_points(file, "/contact_force", r.nodes.size());
  r.times = file.read<double>("/times", {0});
  r.segment = file.read<std::uint16_t>("/mesh/segment", {r.cells.size()});
  for (const std::string& name : file.read_strings("/cell_field_names")) {
    hdf5::check_name(file, "/cell_field_names", name);
    if (r.cell_fields.contains(name)) file.fail(fmt::format("has '{}' twice in '/cell_field_names'", name));
    r.cell_fields[name] = file.read<double>(field_name(name), {r.cells.size()});
  }
  r.conditions = read_conditions(file);
  r.report = read_text(file, "/report");
  if (file.has("/costs")) r.costs = read_text(file, "/costs");
  r.labels = hdf5::read_labels(file, voxels);
  r.surface_of_voxels = hdf5::is_surface_of_voxels(file);
  if (!r.surface_of_voxels) r.surface = hdf5::read_surface(file);
  hdf5::validate(file, r);
  if (!r.surface_of_voxels) move_surface(r);
  return r;
}

MotionStep read_step(const std::filesystem::path& path, const Result& result, std::size_t number) {
  const hdf5::Reader file(path, "result");
  const std::string group = step_group(number);
  MotionStep step{hdf5::read_points(file, group + "/displacement", result.nodes.size()),
                  hdf5::read_points(file, group + "/velocity", result.nodes.size()),
                  {}};
  if (file.has(group + "/contact_force"))
    step.contact_force = hdf5::read_points(file, group + "/contact_force", result.nodes.size());
  if (file.has(step_field_names))
    for (const std::string& name : file.read_strings(step_field_names)) {
      if (!result.cell_fields.contains(name))
        file.fail(fmt::format("has '{}' in '{}', expected names of '/cell_field_names'", name, step_field_names));
      const auto single = file.read<float>(group + field_name(name), {result.cells.size()});
      step.cell_fields[name] = {single.begin(), single.end()};
    }
  hdf5::validate(file, group, step);
  return step;
}

}  // namespace hexmesh
