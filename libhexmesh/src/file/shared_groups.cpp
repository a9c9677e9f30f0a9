// SPDX-License-Identifier: Apache-2.0
#include "shared_groups.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "cell_checks.h"
#include "hexmesh/core/error.h"

namespace hexmesh::hdf5 {

void write_header(Writer& file, const std::string& format, int version, const std::vector<std::string>& history) {
  file.attribute("/", "format", format);
  const std::int32_t number = version;
  file.attribute("/", "version", std::span(&number, 1));
  file.attribute("/", "tool_version", HEXTOOLS_VERSION);
  file.write("/history", history);
}

std::vector<std::string> read_header(const Reader& file, const std::string& format, int version, int newest) {
  const std::string found = file.text_attribute("/", "format");
  if (found != format) file.fail(fmt::format("is a '{}' file, expected a '{}'", found, format));
  const std::int32_t number = file.attribute<std::int32_t>("/", "version", 1)[0];
  if (number < version || number > std::max(version, newest))
    file.fail(fmt::format("has version {}, expected {}: it was made by {} tool{}", number, version,
                          number > version ? "a newer" : "an older", number > version ? "" : ", make it again"));
  return file.read_strings("/history");
}

void write_grid(Writer& file, const Grid& grid) {
  file.attribute("/voxels", "spacing", std::span<const double>(grid.spacing().data(), 3));
  file.attribute("/voxels", "origin", std::span<const double>(grid.origin().data(), 3));
  file.attribute("/voxels", "direction", std::span<const double>(grid.direction().data(), 9));
}

void write_voxels(Writer& file, const Grid& grid, const std::vector<std::uint16_t>& labels) {
  const Index3& n = grid.extent();
  file.write<std::uint16_t>("/voxels/labels", labels,
                            {static_cast<hsize_t>(n[2]), static_cast<hsize_t>(n[1]), static_cast<hsize_t>(n[0])}, true);
  write_grid(file, grid);
}

Grid read_grid(const Reader& file) {
  const Shape shape = file.shape("/voxels/labels", 3);
  for (const hsize_t n : shape)
    if (n < 1 || n > 65536) file.fail(fmt::format("has {} voxels along an axis, expected 1 to 65536", n));
  const auto spacing = file.attribute<double>("/voxels", "spacing", 3);
  const auto origin = file.attribute<double>("/voxels", "origin", 3);
  const auto direction = file.attribute<double>("/voxels", "direction", 9);
  const Index3 extent = {static_cast<std::int32_t>(shape[2]), static_cast<std::int32_t>(shape[1]),
                         static_cast<std::int32_t>(shape[0])};
  try {
    return {extent, Vec3::Map(spacing.data()), Vec3::Map(origin.data()), Mat3::Map(direction.data())};
  } catch (const Error& e) {
    file.fail(fmt::format("has '/voxels' of which the {}", e.what()));
  }
}

std::vector<std::uint16_t> read_labels(const Reader& file, const Grid& grid) {
  const Index3& n = grid.extent();
  return file.read<std::uint16_t>("/voxels/labels",
                                  {static_cast<hsize_t>(n[2]), static_cast<hsize_t>(n[1]), static_cast<hsize_t>(n[0])});
}

void write_segments(Writer& file, const std::vector<LatticeSegment>& segments) {
  std::vector<std::string> names, sources;
  std::vector<std::uint16_t> labels;
  std::vector<double> colors, materials;
  std::vector<std::uint64_t> counts;
  for (const LatticeSegment& s : segments) {
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    names.push_back(s.segment.name);
    labels.push_back(s.segment.label);
    colors.insert(colors.end(), s.segment.color.begin(), s.segment.color.end());
    const Material m = s.material.value_or(Material{none, none, none});
    materials.insert(materials.end(), {m.young, m.poisson, m.density});
    counts.push_back(s.num_voxels);
    sources.push_back(s.source);
  }
  file.write("/segments/name", names);
  file.write<std::uint16_t>("/segments/label", labels, {labels.size()});
  file.write<double>("/segments/color", colors, {labels.size(), 3});
  file.write<double>("/segments/material", materials, {labels.size(), 3});
  file.write("/segments/source", sources);
  file.write<std::uint64_t>("/segments/num_voxels", counts, {labels.size()});
}

namespace {

/// Labels ascend from 1 on; colours and materials are what they can be; no segment has more voxels than there are.
void check_segments(const Reader& file, const std::vector<LatticeSegment>& segments, std::size_t num_voxels) {
  std::size_t left = num_voxels;
  int last = 0;
  for (const LatticeSegment& s : segments) {
    const std::string& name = s.segment.name;
    if (s.segment.label <= last)
      file.fail(fmt::format("has the label {} after {} in '/segments/label', expected ascending ones from 1 on",
                            s.segment.label, last));
    last = s.segment.label;
    for (const double c : s.segment.color)
      if (!(c >= 0 && c <= 1)) file.fail(fmt::format("has {} in '/segments/color' of '{}', expected 0 to 1", c, name));
    if (s.num_voxels > left)
      file.fail(
          fmt::format("has {} voxels of segment '{}' in '/segments/num_voxels', expected at most the {} of "
                      "'/voxels/labels' in all",
                      s.num_voxels, name, num_voxels));
    left -= s.num_voxels;
    if (s.material)
      if (const std::string problem = material_problem(*s.material); !problem.empty())
        file.fail(fmt::format("has a material of segment '{}' in '/segments/material' whose {}", name, problem));
  }
}

}  // namespace

std::vector<LatticeSegment> read_segments(const Reader& file, const Grid& voxels) {
  const std::vector<std::string> names = file.read_strings("/segments/name");
  const Shape::value_type n = names.size();
  const auto labels = file.read<std::uint16_t>("/segments/label", {n});
  const auto colors = file.read<double>("/segments/color", {n, 3});
  const auto materials = file.read<double>("/segments/material", {n, 3});
  const auto counts = file.read<std::uint64_t>("/segments/num_voxels", {n});
  const std::vector<std::string> sources = file.read_strings("/segments/source");
  if (sources.size() != n) file.fail(fmt::format("has {} sources of segments, expected {}", sources.size(), n));
  std::vector<LatticeSegment> segments;
  for (std::size_t s = 0; s < n; ++s) {
    LatticeSegment entry{
        {labels[s], names[s], {colors[3 * s], colors[3 * s + 1], colors[3 * s + 2]}}, {}, counts[s], sources[s]};
    const bool has_none =
        std::isnan(materials[3 * s]) && std::isnan(materials[3 * s + 1]) && std::isnan(materials[3 * s + 2]);
    if (!has_none) entry.material = Material{materials[3 * s], materials[3 * s + 1], materials[3 * s + 2]};
    segments.push_back(std::move(entry));
  }
  check_segments(file, segments, voxels.num_voxels());
  return segments;
}

void write_surface_origin(Writer& file, bool of_voxels) {
  const std::int32_t follows = of_voxels;
  file.attribute("/surface", "of_voxels", std::span(&follows, 1));
}

void write_surface_of_voxels(Writer& file) { write_surface_origin(file, true); }

void write_surface(Writer& file, const TriangleSurface& surface, bool of_voxels) {
  write_surface_origin(file, of_voxels);
  write_points(file, "/surface/points", surface.points);
  file.write<std::int32_t>(
      "/surface/triangles",
      {surface.triangles.empty() ? nullptr : surface.triangles.front().data(), 3 * surface.triangles.size()},
      {surface.triangles.size(), 3});
  file.write<std::uint16_t>("/surface/segment", surface.segment, {surface.segment.size()});
}

bool is_surface_of_voxels(const Reader& file) {
  const std::int32_t follows = file.attribute<std::int32_t>("/surface", "of_voxels", 1)[0];
  if (follows != 0 && follows != 1)
    file.fail(fmt::format("has {} in 'of_voxels' of '/surface', expected 0 or 1", follows));
  return follows != 0;
}

TriangleSurface read_surface(const Reader& file) {
  TriangleSurface surface;
  surface.points = read_points(file, "/surface/points");
  const auto triangles = file.read<std::int32_t>("/surface/triangles", {0, 3});
  check_range(file, "/surface/triangles", triangles, surface.points.size());
  for (std::size_t n = 0; n < triangles.size(); n += 3)
    surface.triangles.push_back({triangles[n], triangles[n + 1], triangles[n + 2]});
  surface.segment = file.read<std::uint16_t>("/surface/segment", {0});
  if (surface.segment.size() != surface.triangles.size())
    file.fail(fmt::format("has {} rows in '/surface/segment', expected {} as in '/surface/triangles'",
                          surface.segment.size(), surface.triangles.size()));
  return surface;
}

void write_points(Writer& file, const std::string& name, const std::vector<Vec3>& points) {
  file.write<double>(name, {points.empty() ? nullptr : points.front().data(), 3 * points.size()}, {points.size(), 3});
}

std::vector<Vec3> read_points(const Reader& file, const std::string& name, std::size_t count) {
  const auto values = file.read<double>(name, {count, 3});
  std::vector<Vec3> points(values.size() / 3);
  if (!points.empty()) std::memcpy(points.front().data(), values.data(), sizeof(double) * values.size());
  return points;
}

namespace {

std::vector<std::uint16_t> stored_indices(const std::vector<Index3>& cells) {
  std::vector<std::uint16_t> values;
  values.reserve(3 * cells.size());
  for (const Index3& c : cells)
    for (const std::int32_t i : c) values.push_back(static_cast<std::uint16_t>(i));
  return values;
}

}  // namespace

void write_cells(Writer& file, const std::string& name, const std::vector<Index3>& cells) {
  file.write<std::uint16_t>(name, stored_indices(cells), {cells.size(), 3});
}

void write_cell_rows(Writer& file, const std::string& name, const std::vector<Index3>& cells, hsize_t first) {
  file.write_rows<std::uint16_t>(name, stored_indices(cells), first, cells.size());
}

namespace {

/// The next cells of a dataset. @throws Error{input} where one is beyond `limit`
void append_cells(const Reader& file, const std::string& name, const Index3& limit,
                  const std::vector<std::uint16_t>& values, std::vector<Index3>& cells) {
  bool is_good = true;
  for (std::size_t n = 0; n < values.size(); n += 3) {
    cells.push_back({values[n], values[n + 1], values[n + 2]});
    is_good &= is_in(limit, cells.back());
  }
  if (is_good) return;
  for (std::size_t n = 0; n < values.size(); ++n)
    if (values[n] >= limit[n % 3])
      file.fail(fmt::format("has a cell at {} along axis {} in '{}', expected below {}", values[n], n % 3, name,
                            limit[n % 3]));
}

}  // namespace

std::vector<Index3> read_cells(const Reader& file, const std::string& name, const Index3& limit, bool may_share) {
  constexpr hsize_t block_rows = 1 << 18;
  std::vector<Index3> cells;
  cells.reserve(file.shape(name, 2)[0]);
  file.read_in_blocks<std::uint16_t>(
      name, {0, 3}, block_rows, [&](const std::vector<std::uint16_t>& values, hsize_t first) {
        append_cells(file, name, limit, values, cells);
        check_order(file, name, std::span(cells).subspan(first > 0 ? first - 1 : 0), may_share);
      });
  if (cells.empty()) file.fail(fmt::format("has no cells in '{}'", name));
  return cells;
}

std::vector<Index3> read_cell_rows(const Reader& file, const std::string& name, const Index3& limit, hsize_t first,
                                   hsize_t count, bool may_share) {
  std::vector<Index3> cells;
  append_cells(file, name, limit, file.read_rows<std::uint16_t>(name, {0, 3}, first, count), cells);
  check_order(file, name, cells, may_share);
  return cells;
}

Index3 read_index(const Reader& file, const std::string& group, const std::string& name) {
  const auto values = file.attribute<std::int32_t>(group, name, 3);
  for (const std::int32_t v : values)
    if (v < 1 || v > 65536) file.fail(fmt::format("has {} in '{}' of '{}', expected 1 to 65536", v, name, group));
  return {values[0], values[1], values[2]};
}

void check_range(const Reader& file, const std::string& name, std::span<const std::int32_t> values, std::size_t limit) {
  bool is_good = true;
  for (const std::int32_t v : values) is_good &= static_cast<std::uint32_t>(v) < limit;
  if (is_good) return;
  for (const std::int32_t v : values)
    if (v < 0 || as_size(v) >= limit)
      file.fail(fmt::format("has number {} in '{}', expected within [0, {})", v, name, limit));
}

}  // namespace hexmesh::hdf5
