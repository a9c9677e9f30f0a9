// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/file/lattice_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "hexmesh/core/error.h"
#include "hexmesh/file/result_file.h"
#include "hexmesh/lattice/element_tree.h"
#include "shared_groups.h"

namespace hexmesh {
namespace {

constexpr hsize_t packed_size = 24 * 25 / 2;

std::string level_group(int level) { return fmt::format("/levels/{}", level); }

/// Upper triangle, column by column: (0,0), (0,1), (1,1), (0,2), ...
void append_packed(const CellMatrix& k, std::vector<double>& out) {
  for (int column = 0; column < 24; ++column)
    for (int row = 0; row <= column; ++row) out.push_back(k(row, column));
}

/// A level's matrices for other programs. They follow from the children and the materials, which is what our own reader
/// uses; they are stored where they cost little.
struct StoredMatrices {
  struct Values {
    const char* name;
    hsize_t width;
    std::vector<double> values;
  };
  std::array<Values, 6> sets = {{{"stiffness", packed_size, {}},
                                 {"deviatoric", packed_size, {}},
                                 {"divergence", 24, {}},
                                 {"volume", 1, {}},
                                 {"bulk", 1, {}},
                                 {"lumped_mass", 8, {}}}};

  StoredMatrices(const ElementMatrices& matrices, const std::vector<Element>& elements) {
    const auto append = [](std::vector<double>& to, const auto& from) {
      to.insert(to.end(), from.begin(), from.end());
    };
    for (const Element& e : elements) {
      append_packed(matrices.stiffness(e), sets[0].values);
      append_packed(matrices.deviatoric(e), sets[1].values);
      append(sets[2].values, matrices.divergence(e));
      sets[3].values.push_back(e.volume());
      sets[4].values.push_back(e.total_bulk());
      append(sets[5].values, matrices.lumped_mass(e));
    }
  }

  static constexpr std::size_t bytes_per_element = (2 * packed_size + 24 + 1 + 1 + 8) * sizeof(double);
  static constexpr std::size_t most_bytes_per_voxel = 16;  ///< of level 0, for one level
  static bool worth_storing(const Lattice& lattice, const Level& level) {
    return level.filled.size() * bytes_per_element <= most_bytes_per_voxel * lattice.levels.front().cells.size();
  }
};

void write_materials(hdf5::Writer& file, const std::vector<VoxelMaterial>& materials) {
  std::vector<std::uint16_t> labels;
  std::vector<double> values;
  for (const VoxelMaterial& m : materials) {
    labels.push_back(m.label);
    values.insert(values.end(), {m.material.young, m.material.poisson, m.material.density});
  }
  file.write<std::uint16_t>("/materials/label", labels, {labels.size()}, true);
  file.write<double>("/materials/value", values, {labels.size(), 3}, true);
}

std::vector<VoxelMaterial> read_materials(const hdf5::Reader& file, const std::vector<LatticeSegment>& segments) {
  const auto labels = file.read<std::uint16_t>("/materials/label", {0});
  const auto values = file.read<double>("/materials/value", {labels.size(), 3});
  std::vector<std::string> names(65536);
  for (const LatticeSegment& s : segments)
    if (s.material) names[s.segment.label] = s.segment.name;
  std::vector<VoxelMaterial> materials;
  for (std::size_t n = 0; n < labels.size(); ++n) {
    if (names[labels[n]].empty()) file.fail(fmt::format("has a material of label {}, which no segment has", labels[n]));
    materials.push_back({labels[n], {values[3 * n], values[3 * n + 1], values[3 * n + 2]}});
    check_material(materials.back().material, names[labels[n]]);
  }
  if (materials.empty()) file.fail("has no materials");
  return materials;
}

void write_level(hdf5::Writer& file, const Lattice& lattice, int number, ElementTree& tree) {
  const Level& level = lattice.levels[static_cast<std::size_t>(number)];
  const std::string group = level_group(number);
  file.attribute(group, "merge", std::span<const std::int32_t>(level.merge));
  file.attribute(group, "voxels_per_cell", std::span<const std::int32_t>(level.voxels_per_cell));
  hdf5::write_cells(file, group + "/cells", level.cells);
  file.write<std::int32_t>(group + "/element", level.element, {level.cells.size()}, true);
  file.write<std::uint16_t>(group + "/segment", level.segment, {level.cells.size()}, true);
  file.write<std::uint16_t>(group + "/parts", level.parts, {level.cells.size()}, true);
  if (number > 0)
    file.write<std::int32_t>(group + "/elements/children", {level.children.front().data(), 8 * level.children.size()},
                             {level.children.size(), 8}, true);
  if (!StoredMatrices::worth_storing(lattice, level)) return;
  const StoredMatrices stored(ElementMatrices(lattice.cell_edges(number)), tree.form_all(number));
  for (const auto& [name, width, values] : stored.sets)
    file.write<double>(group + "/elements/" + name, values, {level.filled.size(), width});
}

/// Children of a level's elements: within the finer level's, none in slots that the merge does not have.
std::vector<Children> read_children(const hdf5::Reader& file, int number, const Index3& merge, std::size_t num_finer) {
  const std::string name = level_group(number) + "/elements/children";
  const auto values = file.read<std::int32_t>(name, {0, 8});
  std::vector<Children> children(values.size() / 8);
  for (std::size_t e = 0; e < children.size(); ++e) {
    int count = 0;
    for (std::size_t slot = 0; slot < 8; ++slot) {
      const std::int32_t child = values[8 * e + slot];
      bool has_slot = true;
      for (std::size_t d = 0; d < 3; ++d)
        has_slot &= merge[d] == 2 || corner_bit(static_cast<int>(slot), static_cast<int>(d)) == 0;
      if (child < -1 || child >= static_cast<std::int64_t>(num_finer) || (child >= 0 && !has_slot))
        file.fail(fmt::format("has child {} in slot {} of '{}', expected -1 to {}", child, slot, name,
                              has_slot ? static_cast<std::int64_t>(num_finer) - 1 : -1));
      children[e][slot] = child;
      count += child >= 0;
    }
    if (count == 0) file.fail(fmt::format("has an element without children in '{}'", name));
  }
  if (children.empty()) file.fail(fmt::format("has no elements in '{}'", name));
  return children;
}

void read_cells(const hdf5::Reader& file, const Grid& voxels, int number, Level& level) {
  const std::string group = level_group(number);
  Index3 limit;
  for (std::size_t d = 0; d < 3; ++d)
    limit[d] = (voxels.extent()[d] + level.voxels_per_cell[d] - 1) / level.voxels_per_cell[d];
  level.cells = hdf5::read_cells(file, group + "/cells", limit);
  if (level.cells.empty()) file.fail(fmt::format("has no cells in '{}'", group));
  const auto before = [](const Index3& a, const Index3& b) {
    return std::array{a[2], a[1], a[0]} < std::array{b[2], b[1], b[0]};
  };
  if (std::adjacent_find(level.cells.begin(), level.cells.end(),
                         [&](const Index3& a, const Index3& b) { return !before(a, b); }) != level.cells.end())
    file.fail(fmt::format("has cells of '{}' twice or out of order", group));
  level.element = file.read<std::int32_t>(group + "/element", {level.cells.size()});
  hdf5::check_range(file, group + "/element", level.element, level.filled.size());
  level.segment = file.read<std::uint16_t>(group + "/segment", {level.cells.size()});
  level.parts = file.read<std::uint16_t>(group + "/parts", {level.cells.size()});
}

/// Each level merges one or two cells along each axis, and some axis.
void check_merge(const hdf5::Reader& file, const std::vector<Level>& levels, int number) {
  const auto n = static_cast<std::size_t>(number);
  const Index3 one = {1, 1, 1}, finer = n > 0 ? levels[n - 1].voxels_per_cell : one;
  bool good = n > 0 ? levels[n].merge != one : levels[n].merge == one;
  for (std::size_t d = 0; d < 3; ++d)
    good &= levels[n].merge[d] <= 2 && levels[n].voxels_per_cell[d] == levels[n].merge[d] * finer[d];
  if (!good) file.fail(fmt::format("has a '{}' that does not merge the level before it", level_group(number)));
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
  hdf5::write_header(file, lattice_format, lattice_version, lattice.history);
  hdf5::write_voxels(file, lattice.voxels, lattice.labels);
  hdf5::write_segments(file, lattice.segments);
  hdf5::write_surface(file, lattice.surface);
  write_materials(file, lattice.materials);
  ElementTree tree(lattice);
  for (int n = 0; n < static_cast<int>(lattice.levels.size()); ++n) write_level(file, lattice, n, tree);
  file.close();
}

Lattice read_lattice(const std::filesystem::path& path, const std::vector<int>& levels) {
  const hdf5::Reader file(path, "lattice");
  std::vector<std::string> history = hdf5::read_header(file, lattice_format, lattice_version);
  auto [grid, labels] = hdf5::read_voxels(file);
  std::vector<LatticeSegment> segments = hdf5::read_segments(file);
  std::vector<VoxelMaterial> materials = read_materials(file, segments);
  Lattice lattice{std::move(grid),          std::move(labels), std::move(segments), std::move(materials), {},
                  hdf5::read_surface(file), std::move(history)};
  const int count = count_levels(file);
  const int coarsest = levels.empty() ? count - 1 : *std::max_element(levels.begin(), levels.end());
  lattice.levels.resize(static_cast<std::size_t>(count));
  for (int n = 0; n < count; ++n) {
    Level& level = lattice.levels[static_cast<std::size_t>(n)];
    level.merge = hdf5::read_index(file, level_group(n), "merge");
    level.voxels_per_cell = hdf5::read_index(file, level_group(n), "voxels_per_cell");
    check_merge(file, lattice.levels, n);
    if (n > 0 && n <= coarsest) {
      const Level& finer = lattice.levels[static_cast<std::size_t>(n - 1)];
      level.children = read_children(file, n, level.merge, n == 1 ? lattice.materials.size() : finer.children.size());
    }
  }
  count_filled(lattice.levels, lattice.materials.size());
  for (int n = 0; n < count; ++n)
    if (levels.empty() || std::find(levels.begin(), levels.end(), n) != levels.end())
      read_cells(file, lattice.voxels, n, lattice.levels[static_cast<std::size_t>(n)]);
  return lattice;
}

double stored_matrix_error(const std::filesystem::path& path, const Lattice& lattice) {
  const hdf5::Reader file(path, "lattice");
  ElementTree tree(lattice);
  double worst = 0;
  for (int n = 0; n < static_cast<int>(lattice.levels.size()); ++n) {
    const Level& level = lattice.levels[static_cast<std::size_t>(n)];
    const std::string group = level_group(n) + "/elements/";
    if (!file.has(group + "stiffness")) continue;
    const StoredMatrices formed(ElementMatrices(lattice.cell_edges(n)), tree.form_all(n));
    for (const auto& [name, width, values] : formed.sets) {
      const auto stored = file.read<double>(group + name, {level.filled.size(), width});
      double difference = 0, largest = 0;
      for (std::size_t i = 0; i < values.size(); ++i) {
        difference = std::max(difference, std::abs(stored[i] - values[i]));
        largest = std::max(largest, std::abs(values[i]));
      }
      if (largest > 0) worst = std::max(worst, difference / largest);
    }
  }
  return worst;
}

std::string format_of(const std::filesystem::path& path) {
  const hdf5::Reader file(path, "input");
  std::string format = file.text_attribute("/", "format");
  if (format != lattice_format && format != result_format)
    file.fail(fmt::format("is a '{}' file, expected a '{}' or a '{}'", format, lattice_format, result_format));
  return format;
}

int count_levels(const std::filesystem::path& path) {
  const hdf5::Reader file(path, "lattice");
  hdf5::read_header(file, lattice_format, lattice_version);
  return count_levels(file);
}

}  // namespace hexmesh
