// SPDX-License-Identifier: Apache-2.0
#include "result_checks.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <nlohmann/json.hpp>

#include "bounds.h"
#include "cell_checks.h"
#include "hexmesh/file/json_limits.h"

namespace hexmesh::hdf5 {
namespace {

/// Each level merges one or two cells along each axis, and some axis.
void check_level(const Reader& file, const Result& r) {
  int halvings = 0;
  for (const std::int32_t n : r.voxels_per_cell) {
    if (!std::has_single_bit(static_cast<std::uint32_t>(n)))
      file.fail(fmt::format("has {} in 'voxels_per_cell' of '/mesh', expected a power of 2", n));
    halvings += std::countr_zero(static_cast<std::uint32_t>(n));
  }
  if (r.level < 0 || r.level > halvings || halvings > 3 * r.level)
    file.fail(fmt::format("has level {} in '/mesh' with cells of {} voxels, which no level of that number has", r.level,
                          text_of(r.voxels_per_cell)));
}

/// The places of nodes among those of all cells of the box, as sort keys.
std::vector<std::uint64_t> places_of_nodes(const Reader& file, const Result& r) {
  const Index3 extent = coarser_extent(r.voxels.extent(), r.voxels_per_cell);
  const Vec3 size =
      r.voxels.spacing().cwiseProduct(Vec3(r.voxels_per_cell[0], r.voxels_per_cell[1], r.voxels_per_cell[2]));
  const Vec3 corner = r.voxels.position(Vec3::Constant(-0.5));
  // Not the transpose: directions are orthonormal to 1e-3 only, which a box of thousands of cells sees.
  const Mat3 edges = r.voxels.direction() * size.asDiagonal(), inverse = edges.inverse();
  const double allowed = 1e-6 * size.minCoeff() + 1e-12 * (corner.norm() + edges.norm() * 65536);
  std::vector<std::uint64_t> places(r.nodes.size());
  for (std::size_t n = 0; n < r.nodes.size(); ++n) {
    const Vec3 place = inverse * (r.nodes[n] - corner);
    Index3 nearest = {0, 0, 0};
    bool is_good = true;
    for (std::size_t d = 0; d < 3; ++d) {
      const double p = place[static_cast<Eigen::Index>(d)] + 0.5;
      is_good &= p >= 0 && p < extent[d] + 1;  // NaN is not
      nearest[d] = is_good ? static_cast<std::int32_t>(p) : 0;
    }
    is_good = is_good && (edges * Vec3(nearest[0], nearest[1], nearest[2]) + corner - r.nodes[n]).squaredNorm() <=
                             allowed * allowed;
    if (!is_good)
      file.fail(fmt::format("has the node ({:g}, {:g}, {:g}) in row {} of '/mesh/nodes', expected a corner of a cell",
                            r.nodes[n][0], r.nodes[n][1], r.nodes[n][2], n));
    places[n] = sort_key(nearest);
  }
  return places;
}

void check_nodes(const Reader& file, const Result& r) {
  const std::vector<std::uint64_t> places = places_of_nodes(file, r);
  std::array<std::uint64_t, 8> to_corner{};
  for (int a = 0; a < 8; ++a) to_corner[static_cast<std::size_t>(a)] = sort_key({a & 1, a >> 1 & 1, a >> 2});
  for (std::size_t c = 0; c < r.cells.size(); ++c) {
    const std::uint64_t place = sort_key(r.cells[c]);
    bool is_good = true;
    for (std::size_t a = 0; a < 8; ++a) is_good &= places[as_size(r.cell_nodes[c][a])] == place + to_corner[a];
    if (!is_good)
      file.fail(fmt::format("has nodes of cell {} in row {} of '/mesh/cell_nodes' that are not at its corners",
                            text_of(r.cells[c]), c));
  }
}

nlohmann::json parse(const Reader& file, const std::string& text, const char* name) {
  try {
    nlohmann::json out = parse_json(text);
    if (out.is_object()) return out;
  } catch (const std::runtime_error& e) {
    file.fail(fmt::format("has in '{}' {}", name, e.what()));
  }
  file.fail(fmt::format("has JSON in '{}' that is no object", name));
}

/// Whether cells may have been left out: the report says so, or there is none, as of a result of another program.
bool may_lack_cells(const Reader& file, const Result& r) {
  if (!r.costs.empty()) parse(file, r.costs, "/costs");
  if (r.report.empty()) return true;
  const nlohmann::json report = parse(file, r.report, "/report");
  const auto dropped = report.find("dropped_cells");
  return dropped != report.end() && dropped->is_number() && dropped->get<double>() > 0;
}

void check_conditions(const Reader& file, const Result& r) {
  for (std::size_t n = 0; n < r.conditions.size(); ++n) {
    const std::string group = fmt::format("/conditions/{}", n);
    const ConditionPoints& c = r.conditions[n];
    if (c.displacement.size() != c.points.size())
      file.fail(fmt::format("has {} rows in '{}/displacement', expected {} as in 'points'", c.displacement.size(),
                            group, c.points.size()));
    check_places(file, group + "/points", c.points, r.voxels);
    check_values(file, group + "/displacement", c.displacement, most_displacement);
  }
}

void check_times(const Reader& file, const std::vector<double>& times) {
  check_values(file, "/times", std::span<const double>(times), most_time);
  for (std::size_t n = 1; n < times.size(); ++n)
    if (!(times[n] > times[n - 1]))
      file.fail(fmt::format("has {:g} s after {:g} s in '/times', expected them to ascend", times[n], times[n - 1]));
}

}  // namespace

void validate(const Reader& file, const Result& r) {
  check_level(file, r);
  if (r.nodes.empty()) file.fail("has no nodes in '/mesh/nodes'");
  check_nodes(file, r);
  check_segments(file, "/mesh/segment", r.segment, r.segments, LabelKind::with_material);
  const StoredCells cells{"/mesh/cells", r.cells, r.voxels_per_cell, !may_lack_cells(file, r)};
  if (cells.are_all) check_box(file, r.voxels, r.segments, cells);
  check_counts(file, check_labels(file, r.voxels, r.labels, r.segments, cells), r.segments);
  check_values(file, "/displacement", r.displacement, most_displacement);
  check_values(file, "/rest_displacement", r.rest_displacement, most_displacement);
  check_values(file, "/velocity", r.velocity, most_velocity);
  check_values(file, "/load", r.load, most_load);
  check_values(file, "/contact_force", r.contact_force, most_load);
  check_times(file, r.times);
  for (const auto& [name, values] : r.cell_fields)
    check_values(file, "/cell_fields/" + name, std::span<const double>(values), most_field);
  check_conditions(file, r);
  check_places(file, "/surface/points", r.surface.points, r.voxels);
  check_segments(file, "/surface/segment", r.surface.segment, r.segments, LabelKind::without_material);
}

void validate(const Reader& file, const std::string& name, const MotionStep& step) {
  check_values(file, name + "/displacement", step.displacement, most_displacement);
  check_values(file, name + "/velocity", step.velocity, most_velocity);
  check_values(file, name + "/contact_force", step.contact_force, most_load);
  for (const auto& [field, values] : step.cell_fields)
    check_values(file, fmt::format("{}/cell_fields/{}", name, field), std::span<const double>(values), most_field);
}

void check_name(const Reader& file, const std::string& dataset, const std::string& name) {
  constexpr std::size_t most_bytes = 255;
  const bool has_control = std::any_of(name.begin(), name.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; });
  if (name.empty() || name.size() > most_bytes || name.find('/') != std::string::npos || name[0] == '.' || has_control)
    file.fail(
        fmt::format("has a name of {} bytes in '{}' that cannot be one, expected at most {} without / and signs "
                    "that control",
                    name.size(), dataset, most_bytes));
}

}  // namespace hexmesh::hdf5
