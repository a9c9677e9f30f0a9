// SPDX-License-Identifier: Apache-2.0
#include "shared_groups.h"

#include <fmt/format.h>

#include <limits>

#include "hexmesh/core/error.h"

namespace hexmesh::hdf5 {

void write_header(Writer& file, const std::string& format, int version, const std::vector<std::string>& history) {
  file.attribute("/", "format", format);
  const std::int32_t number = version;
  file.attribute("/", "version", std::span(&number, 1));
  file.attribute("/", "tool_version", HEXTOOLS_VERSION);
  file.write("/history", history);
}

std::vector<std::string> read_header(const Reader& file, const std::string& format, int version) {
  const std::string found = file.text_attribute("/", "format");
  if (found != format) file.fail(fmt::format("is a '{}' file, expected a '{}'", found, format));
  const std::int32_t number = file.attribute<std::int32_t>("/", "version", 1)[0];
  if (number != version)
    file.fail(fmt::format("has version {}, expected {}: it was made by {} tool{}", number, version,
                          number > version ? "a newer" : "an older", number > version ? "" : ", make it again"));
  return file.read_strings("/history");
}

void write_voxels(Writer& file, const Grid& grid, const std::vector<std::uint16_t>& labels) {
  const Index3& n = grid.extent();
  file.write<std::uint16_t>("/voxels/labels", labels,
                            {static_cast<hsize_t>(n[2]), static_cast<hsize_t>(n[1]), static_cast<hsize_t>(n[0])}, true);
  file.attribute("/voxels", "spacing", std::span<const double>(grid.spacing().data(), 3));
  file.attribute("/voxels", "origin", std::span<const double>(grid.origin().data(), 3));
  file.attribute("/voxels", "direction", std::span<const double>(grid.direction().data(), 9));
}

Grid read_grid(const Reader& file) {
  const Shape shape = file.shape("/voxels/labels", 3);
  for (const hsize_t n : shape)
    if (n < 1 || n > 65536) file.fail(fmt::format("has {} voxels along an axis, expected 1 to 65536", n));
  const auto spacing = file.attribute<double>("/voxels", "spacing", 3);
  const auto origin = file.attribute<double>("/voxels", "origin", 3);
  const auto direction = file.attribute<double>("/voxels", "direction", 9);
  return {
      {static_cast<std::int32_t>(shape[2]), static_cast<std::int32_t>(shape[1]), static_cast<std::int32_t>(shape[0])},
      Vec3::Map(spacing.data()),
      Vec3::Map(origin.data()),
      Mat3::Map(direction.data())};
}

std::vector<std::uint16_t> read_labels(const Reader& file) {
  return file.read<std::uint16_t>("/voxels/labels", file.shape("/voxels/labels", 3));
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

std::vector<LatticeSegment> read_segments(const Reader& file) {
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
    if (!std::isnan(materials[3 * s])) {
      entry.material = Material{materials[3 * s], materials[3 * s + 1], materials[3 * s + 2]};
      check_material(*entry.material, names[s]);
    }
    segments.push_back(std::move(entry));
  }
  return segments;
}

namespace {

void write_origin(Writer& file, bool of_voxels) {
  const std::int32_t follows = of_voxels;
  file.attribute("/surface", "of_voxels", std::span(&follows, 1));
}

}  // namespace

void write_surface_of_voxels(Writer& file) { write_origin(file, true); }

void write_surface(Writer& file, const TriangleSurface& surface, bool of_voxels) {
  write_origin(file, of_voxels);
  write_points(file, "/surface/points", surface.points);
  file.write<std::int32_t>(
      "/surface/triangles",
      {surface.triangles.empty() ? nullptr : surface.triangles.front().data(), 3 * surface.triangles.size()},
      {surface.triangles.size(), 3});
  file.write<std::uint16_t>("/surface/segment", surface.segment, {surface.segment.size()});
}

bool is_surface_of_voxels(const Reader& file) {
  return file.attribute<std::int32_t>("/surface", "of_voxels", 1)[0] != 0;
}

TriangleSurface read_surface(const Reader& file) {
  TriangleSurface surface;
  surface.points = read_points(file, "/surface/points");
  const auto triangles = file.read<std::int32_t>("/surface/triangles", {0, 3});
  check_range(file, "/surface/triangles", triangles, surface.points.size());
  for (std::size_t n = 0; n < triangles.size(); n += 3)
    surface.triangles.push_back({triangles[n], triangles[n + 1], triangles[n + 2]});
  surface.segment = file.read<std::uint16_t>("/surface/segment", {surface.triangles.size()});
  return surface;
}

void write_points(Writer& file, const std::string& name, const std::vector<Vec3>& points) {
  file.write<double>(name, {points.empty() ? nullptr : points.front().data(), 3 * points.size()}, {points.size(), 3});
}

std::vector<Vec3> read_points(const Reader& file, const std::string& name, std::size_t count) {
  const auto values = file.read<double>(name, {count, 3});
  std::vector<Vec3> points;
  for (std::size_t n = 0; n < values.size(); n += 3) points.push_back(Vec3::Map(&values[n]));
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

std::vector<Index3> to_cells(const Reader& file, const std::string& name, const Index3& limit,
                             const std::vector<std::uint16_t>& values) {
  std::vector<Index3> cells(values.size() / 3);
  for (std::size_t n = 0; n < values.size(); ++n) {
    const int axis = static_cast<int>(n % 3);
    cells[n / 3][axis] = values[n];
    if (values[n] >= limit[axis])
      file.fail(
          fmt::format("has a cell at {} along axis {} in '{}', expected below {}", values[n], axis, name, limit[axis]));
  }
  return cells;
}

}  // namespace

std::vector<Index3> read_cells(const Reader& file, const std::string& name, const Index3& limit) {
  return to_cells(file, name, limit, file.read<std::uint16_t>(name, {0, 3}));
}

std::vector<Index3> read_cell_rows(const Reader& file, const std::string& name, const Index3& limit, hsize_t first,
                                   hsize_t count) {
  return to_cells(file, name, limit, file.read_rows<std::uint16_t>(name, {0, 3}, first, count));
}

Index3 read_index(const Reader& file, const std::string& group, const std::string& name) {
  const auto values = file.attribute<std::int32_t>(group, name, 3);
  for (const std::int32_t v : values)
    if (v < 1 || v > 65536) file.fail(fmt::format("has {} in '{}' of '{}', expected 1 to 65536", v, name, group));
  return {values[0], values[1], values[2]};
}

void check_range(const Reader& file, const std::string& name, std::span<const std::int32_t> values, std::size_t limit) {
  for (const std::int32_t v : values)
    if (v < 0 || as_size(v) >= limit)
      file.fail(fmt::format("has number {} in '{}', expected within [0, {})", v, name, limit));
}

}  // namespace hexmesh::hdf5
