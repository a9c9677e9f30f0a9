// SPDX-License-Identifier: Apache-2.0
#include "lattice_groups.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hexmesh/file/lattice_file.h"

namespace hexmesh::hdf5 {
namespace {

/// Each level merges one or two cells along each axis, and some axis.
void check_merge(const Reader& file, const std::vector<Level>& levels, int n) {
  const Index3 one = {1, 1, 1}, finer = n > 0 ? levels[n - 1].voxels_per_cell : one;
  bool good = n > 0 ? levels[n].merge != one : levels[n].merge == one;
  for (std::size_t d = 0; d < 3; ++d)
    good &= levels[n].merge[d] <= 2 && levels[n].voxels_per_cell[d] == levels[n].merge[d] * finer[d];
  if (!good) file.fail(fmt::format("has a '{}' that does not merge the level before it", level_group(n)));
}

std::string matrix_name(int level, const char* set) { return level_group(level) + "/elements/" + set; }

std::string subcells_name(int level) { return level_group(level) + "/elements/subcells"; }

/// Of files without them only cells that are full are known.
void read_subcells(const Reader& file, int number, Level& level, const std::vector<std::int32_t>* numbers) {
  const std::string name = subcells_name(number);
  const Index3& n = level.voxels_per_cell;
  const std::size_t count = level.filled.size();
  if (!file.has(name)) {
    level.subcells.clear();
    for (const std::int64_t filled : level.filled)
      level.subcells.push_back(filled == std::int64_t{n[0]} * n[1] * n[2] ? all_subcells : 0);
    return;
  }
  level.subcells =
      numbers ? read_selected_rows<SubcellMask>(file, name, 1, *numbers) : file.read<SubcellMask>(name, {count, 1});
  for (std::size_t e = 0; e < count; ++e)
    if (level.subcells[e] == 0) file.fail(fmt::format("has an element without subcells in '{}'", name));
}

/// Voxels with material per element, from the filled volumes.
void count_filled(const Reader& file, const Lattice& lattice, int number, Level& level) {
  constexpr double rounding = 1e-6;
  const double voxel = lattice.voxels.voxel_volume();
  const Index3& n = level.voxels_per_cell;
  const double most = 1.0 * n[0] * n[1] * n[2];
  level.filled.clear();
  for (std::size_t e = 0; e < level.matrices.size(); ++e) {
    const double count = level.matrices.volume(e) / voxel, whole = std::round(count);
    if (!(whole >= 1 && whole <= most && std::abs(count - whole) <= rounding * most))
      file.fail(fmt::format("has {:g} voxels in element {} of level {}, expected a whole number from 1 to {:g}", count,
                            e, number, most));
    level.filled.push_back(static_cast<std::int64_t>(whole));
  }
}

}  // namespace

std::string level_group(int level) { return fmt::format("/levels/{}", level); }

std::string children_name(int level) { return level_group(level) + "/elements/children"; }

void write_materials(Writer& file, const std::vector<VoxelMaterial>& materials) {
  std::vector<std::uint16_t> labels;
  std::vector<double> values;
  for (const VoxelMaterial& m : materials) {
    labels.push_back(m.label);
    values.insert(values.end(), {m.material.young, m.material.poisson, m.material.density});
  }
  file.write<std::uint16_t>("/materials/label", labels, {labels.size()}, true);
  file.write<double>("/materials/value", values, {labels.size(), 3}, true);
}

std::vector<VoxelMaterial> read_materials(const Reader& file, const std::vector<LatticeSegment>& segments) {
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

void check_order(const Reader& file, const std::string& group, const std::vector<Index3>& cells) {
  if (std::adjacent_find(cells.begin(), cells.end(),
                         [&](const Index3& a, const Index3& b) { return !i_fastest(a, b); }) != cells.end())
    file.fail(fmt::format("has cells of '{}' twice or out of order", group));
}

std::vector<Children> to_children(const Reader& file, int level, const std::vector<std::int32_t>& values,
                                  const Index3& merge, std::size_t num_finer) {
  const std::string name = children_name(level);
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

int count_levels(const Reader& file) {
  int count = 0;
  while (file.has(level_group(count))) ++count;
  if (count == 0) file.fail("has no levels");
  return count;
}

std::size_t count_cells(const Reader& file, int level) {
  const std::size_t count = file.shape(level_group(level) + "/cells", 2)[0];
  if (count == 0) file.fail(fmt::format("has no cells in '{}'", level_group(level)));
  return count;
}

std::vector<Level> read_merges(const Reader& file) {
  std::vector<Level> levels(as_size(count_levels(file)));
  for (int n = 0; n < static_cast<int>(levels.size()); ++n) {
    Level& level = levels[n];
    level.merge = read_index(file, level_group(n), "merge");
    level.voxels_per_cell = read_index(file, level_group(n), "voxels_per_cell");
    check_merge(file, levels, n);
  }
  return levels;
}

Lattice read_outline(const Reader& file) {
  std::vector<std::string> history = read_header(file, lattice_format, lattice_version);
  std::vector<LatticeSegment> segments = read_segments(file);
  std::vector<VoxelMaterial> materials = read_materials(file, segments);
  Lattice lattice{read_grid(file), {}, std::move(segments), std::move(materials), {}, {}, std::move(history)};
  lattice.surface_of_voxels = is_surface_of_voxels(file);
  lattice.levels = read_merges(file);
  return lattice;
}

void declare_matrices(Writer& file, int level, std::size_t num_elements) {
  const StoredMatrices none;
  for (const StoredMatrices::Set& set : none.sets())
    file.declare<double>(matrix_name(level, set.name), {num_elements, set.width});
}

void write_subcells(Writer& file, int level, const std::vector<SubcellMask>& subcells) {
  file.write<SubcellMask>(subcells_name(level), subcells, {subcells.size(), 1}, true);
}

void write_matrices(Writer& file, int level, std::size_t first, const StoredMatrices& matrices) {
  for (const StoredMatrices::Set& set : matrices.sets())
    file.write_rows<double>(matrix_name(level, set.name), set.values, first, matrices.size());
}

std::vector<double> read_matrix_rows(const Reader& file, int level, const char* set, std::size_t width,
                                     std::size_t first, std::size_t count) {
  const std::string name = matrix_name(level, set);
  if (!file.has(name)) return {};
  return file.read_rows<double>(name, {0, width}, first, count);
}

bool has_matrices(const Reader& file, int level) {
  const StoredMatrices none;
  for (const StoredMatrices::Set& set : none.sets())
    if (!file.has(matrix_name(level, set.name))) return false;
  return true;
}

void read_matrices(const Reader& file, const Lattice& lattice, int number, Level& level,
                   const std::vector<std::int32_t>* numbers) {
  const std::size_t count = number == 0 ? lattice.materials.size() : file.shape(children_name(number), 2)[0];
  for (auto& [name, width, values] : level.matrices.sets()) {
    const std::string path = matrix_name(number, name);
    values =
        numbers ? read_selected_rows<double>(file, path, width, *numbers) : file.read<double>(path, {count, width});
  }
  if (const std::ptrdiff_t e = level.matrices.find_contradiction(lattice.cell_edges(number)); e >= 0)
    file.fail(
        fmt::format("has matrices of element {} of level {} that contradict each other, expected stiffness, "
                    "deviatoric, bulk, divergence, volume and shape of one material",
                    numbers ? (*numbers)[static_cast<std::size_t>(e)] : e, number));
  count_filled(file, lattice, number, level);
  read_subcells(file, number, level, numbers);
}

}  // namespace hexmesh::hdf5
