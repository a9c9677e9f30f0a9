// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/file/lattice_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "hexmesh/core/error.h"
#include "shared_groups.h"

namespace hexmesh {
namespace {

constexpr const char* format_name = "hexmesh lattice";

/// Matrices follow from the integrals; they are stored as well where they cost at most this.
constexpr std::size_t matrix_bytes_per_voxel = 32;
constexpr hsize_t packed_size = 24 * 25 / 2;

std::string level_group(int level) { return fmt::format("/levels/{}", level); }

/// Upper triangle, column by column: (0,0), (0,1), (1,1), (0,2), ...
void append_packed(const CellMatrix& k, std::vector<double>& out) {
  for (int column = 0; column < 24; ++column)
    for (int row = 0; row <= column; ++row) out.push_back(k(row, column));
}

void write_weights(hdf5::Writer& file, const std::string& name, const std::vector<Element>& elements,
                   Element::Weights Element::*which) {
  std::vector<double> values;
  for (const Element& e : elements) values.insert(values.end(), (e.*which).begin(), (e.*which).end());
  file.write<double>(name, values, {elements.size(), num_rule_points});
}

void read_weights(const hdf5::Reader& file, const std::string& name, std::vector<Element>& elements,
                  Element::Weights Element::*which) {
  const auto values = file.read<double>(name, {elements.size(), num_rule_points});
  for (const double v : values)
    if (!std::isfinite(v)) file.fail(fmt::format("has a value that is not finite in '{}'", name));
  for (std::size_t n = 0; n < elements.size(); ++n)
    std::copy_n(&values[n * num_rule_points], num_rule_points, (elements[n].*which).begin());
}

void write_level(hdf5::Writer& file, const Lattice& lattice, int number) {
  const Level& level = lattice.levels[static_cast<std::size_t>(number)];
  const std::string group = level_group(number);
  file.attribute(group, "merge", std::span<const std::int32_t>(level.merge));
  file.attribute(group, "voxels_per_cell", std::span<const std::int32_t>(level.voxels_per_cell));
  hdf5::write_cells(file, group + "/cells", level.cells);
  file.write<std::int32_t>(group + "/element", level.element, {level.cells.size()});
  file.write<std::uint16_t>(group + "/segment", level.segment, {level.cells.size()});
  write_weights(file, group + "/elements/shear", level.elements, &Element::shear);
  write_weights(file, group + "/elements/bulk", level.elements, &Element::bulk);
  write_weights(file, group + "/elements/density", level.elements, &Element::density);
  write_weights(file, group + "/elements/fill", level.elements, &Element::fill);

  if (level.elements.size() * (packed_size + 8) * sizeof(double) >
      matrix_bytes_per_voxel * lattice.levels.front().cells.size())
    return;
  const ElementMatrices matrices(lattice.cell_edges(number));
  std::vector<double> stiffness, mass;
  for (const Element& e : level.elements) {
    append_packed(matrices.stiffness(e), stiffness);
    const NodeWeights m = matrices.lumped_mass(e);
    mass.insert(mass.end(), m.begin(), m.end());
  }
  file.write<double>(group + "/elements/stiffness", stiffness, {level.elements.size(), packed_size});
  file.write<double>(group + "/elements/lumped_mass", mass, {level.elements.size(), 8});
}

Level read_level(const hdf5::Reader& file, const Grid& voxels, int number) {
  const std::string group = level_group(number);
  Level level;
  level.merge = hdf5::read_index(file, group, "merge");
  level.voxels_per_cell = hdf5::read_index(file, group, "voxels_per_cell");
  Index3 limit;
  for (int d = 0; d < 3; ++d) limit[d] = (voxels.extent()[d] + level.voxels_per_cell[d] - 1) / level.voxels_per_cell[d];
  level.cells = hdf5::read_cells(file, group + "/cells", limit);
  if (level.cells.empty()) file.fail(fmt::format("has no cells in '{}'", group));
  const auto before = [](const Index3& a, const Index3& b) {
    return std::array{a[2], a[1], a[0]} < std::array{b[2], b[1], b[0]};
  };
  if (std::adjacent_find(level.cells.begin(), level.cells.end(),
                         [&](const Index3& a, const Index3& b) { return !before(a, b); }) != level.cells.end())
    file.fail(fmt::format("has cells of '{}' twice or out of order", group));
  level.element = file.read<std::int32_t>(group + "/element", {level.cells.size()});
  level.segment = file.read<std::uint16_t>(group + "/segment", {level.cells.size()});
  level.elements.resize(file.shape(group + "/elements/fill", 2)[0]);
  if (level.elements.size() > level.cells.size()) file.fail(fmt::format("has more elements than cells in '{}'", group));
  hdf5::check_range(file, group + "/element", level.element, level.elements.size());
  read_weights(file, group + "/elements/shear", level.elements, &Element::shear);
  read_weights(file, group + "/elements/bulk", level.elements, &Element::bulk);
  read_weights(file, group + "/elements/density", level.elements, &Element::density);
  read_weights(file, group + "/elements/fill", level.elements, &Element::fill);
  for (const Element& e : level.elements)
    if (!(e.volume() > 0)) file.fail(fmt::format("has an empty element in '{}'", group));
  return level;
}

int count_levels(const hdf5::Reader& file) {
  int count = 0;
  while (file.has(level_group(count))) ++count;
  if (count == 0) file.fail("has no levels");
  return count;
}

}  // namespace

void write_lattice(const Lattice& lattice, const std::filesystem::path& path) {
  hdf5::Writer file(path);
  hdf5::write_header(file, format_name, lattice_version, lattice.history);
  hdf5::write_voxels(file, lattice.voxels, lattice.labels);
  hdf5::write_segments(file, lattice.segments);
  hdf5::write_surface(file, lattice.surface);
  for (int n = 0; n < static_cast<int>(lattice.levels.size()); ++n) write_level(file, lattice, n);
  file.close();
}

Lattice read_lattice(const std::filesystem::path& path, const std::vector<int>& levels) {
  const hdf5::Reader file(path, "lattice");
  std::vector<std::string> history = hdf5::read_header(file, format_name, lattice_version);
  auto [grid, labels] = hdf5::read_voxels(file);
  Lattice lattice{std::move(grid),          std::move(labels), hdf5::read_segments(file), {},
                  hdf5::read_surface(file), std::move(history)};
  const int count = count_levels(file);
  for (int n = 0; n < count; ++n) {
    const bool wanted = levels.empty() || std::find(levels.begin(), levels.end(), n) != levels.end();
    lattice.levels.push_back(wanted ? read_level(file, lattice.voxels, n) : Level{});
    lattice.levels.back().voxels_per_cell = hdf5::read_index(file, level_group(n), "voxels_per_cell");
    lattice.levels.back().merge = hdf5::read_index(file, level_group(n), "merge");
  }
  return lattice;
}

int count_levels(const std::filesystem::path& path) {
  const hdf5::Reader file(path, "lattice");
  hdf5::read_header(file, format_name, lattice_version);
  return count_levels(file);
}

}  // namespace hexmesh
