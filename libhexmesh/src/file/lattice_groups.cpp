// SPDX-License-Identifier: Apache-2.0
#include "lattice_groups.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "cell_checks.h"
#include "hexmesh/file/lattice_file.h"
#include "split_groups.h"

namespace hexmesh::hdf5 {
namespace {

constexpr int most_levels = 49;  ///< of 65536 cells along each axis, level 0 included

/// Each level merges one or two cells along each axis, and some axis.
void check_merge(const Reader& file, const std::vector<Level>& levels, int n) {
  const Index3 one = {1, 1, 1}, finer = n > 0 ? levels[n - 1].voxels_per_cell : one;
  bool good = n > 0 ? levels[n].merge != one : levels[n].merge == one;
  for (std::size_t d = 0; d < 3; ++d)
    good &= levels[n].merge[d] <= 2 && levels[n].voxels_per_cell[d] == levels[n].merge[d] * finer[d];
  if (!good) file.fail(fmt::format("has a '{}' that does not merge the level before it", level_group(n)));
}

double read_mixture(const Reader& file, int level) {
  constexpr double most = 1e12;  // beyond any contrast that is solved
  const double mixture = file.attribute<double>(level_group(level), "mixture", 1)[0];
  if (!(mixture >= 0 && mixture <= most) || (level == 0 && mixture != 0))
    file.fail(fmt::format("has a mixture of {:g} in '{}', expected {}", mixture, level_group(level),
                          level == 0 ? "0, of voxels" : "0 to 1e12"));
  return mixture;
}

/// Files of before have none.
OpenGaps read_gaps(const Reader& file, int level) {
  if (!file.has_attribute(level_group(level), gaps_name)) return {};
  const std::vector<double> v = file.attribute<double>(level_group(level), gaps_name, 3);
  for (const double area : v)
    if (!(area >= 0 && area < std::numeric_limits<double>::infinity()))
      file.fail(fmt::format("has gaps of {:g} in '{}', expected areas", area, level_group(level)));
  return {v[0], v[1], v[2]};
}

/// Whether as many voxels can lie in these subcells: at most as many as fit, and one at least in each.
bool is_possible(SubcellMask subcells, std::int64_t filled, const Index3& voxels_per_cell) {
  std::int64_t voxels = 1, subcells_of_voxel = 1;
  for (const std::int32_t n : voxels_per_cell) {
    voxels *= n;
    subcells_of_voxel *= std::max(1, subcells_along / n);
  }
  const std::int64_t count = std::popcount(subcells), all = std::popcount(all_subcells);
  return filled * all <= count * voxels && count <= filled * subcells_of_voxel;
}

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
    if (!is_possible(level.subcells[e], level.filled[e], n))
      file.fail(fmt::format("has {} voxels in {} subcells of an element in '{}', which cannot be", level.filled[e],
                            std::popcount(level.subcells[e]), name));
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

/// No element is heavier than its volume of the densest material.
void check_masses(const Reader& file, const Lattice& lattice, int number, const Level& level) {
  constexpr double rounding = 1e-9;
  double densest = 0;
  for (const VoxelMaterial& m : lattice.materials) densest = std::max(densest, m.material.density);
  for (std::size_t e = 0; e < level.matrices.size(); ++e) {
    const NodeWeights masses = level.matrices.lumped_mass(e);
    const double most = densest * level.matrices.volume(e) * (1 + rounding);
    if (!(masses.minCoeff() >= -rounding * most && masses.sum() <= most))
      file.fail(fmt::format("has a lumped mass of {:g} tonne in element {} of level {}, expected 0 to {:g}",
                            masses.sum(), e, number, most));
  }
}

}  // namespace

std::string level_group(int level) { return fmt::format("/levels/{}", level); }

std::string matrix_name(int level, const char* set) { return level_group(level) + "/elements/" + set; }

std::string subcells_name(int level) { return level_group(level) + "/elements/subcells"; }

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
  // Each is that of some voxel.
  if (labels.size() > count_material(segments))
    file.fail(
        fmt::format("has {} materials in '/materials/label', expected at most {} as voxels in '/segments/num_voxels'",
                    labels.size(), count_material(segments)));
  for (std::size_t n = 0; n < labels.size(); ++n) {
    if (names[labels[n]].empty()) file.fail(fmt::format("has a material of label {}, which no segment has", labels[n]));
    materials.push_back({labels[n], {values[3 * n], values[3 * n + 1], values[3 * n + 2]}});
    if (const std::string problem = material_problem(materials.back().material); !problem.empty())
      file.fail(fmt::format("has a material of segment '{}' in row {} of '/materials/value' whose {}", names[labels[n]],
                            n, problem));
  }
  if (materials.empty()) file.fail("has no materials");
  return materials;
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
  while (count <= most_levels && file.has(level_group(count))) ++count;
  if (count == 0) file.fail("has no levels");
  if (const std::size_t links = file.count_links("/levels"); count <= most_levels && links != as_size(count))
    file.fail(fmt::format("has {} groups in '/levels', expected {}, numbered from 0 on", links, count));
  if (count > most_levels)
    file.fail(fmt::format("has more than {} levels, expected each to merge some axis", most_levels));
  return count;
}

std::size_t count_cells(const Reader& file, int level) {
  const std::size_t count = file.shape(level_group(level) + "/cells", 2)[0];
  if (count == 0) file.fail(fmt::format("has no cells in '{}'", level_group(level)));
  return count;
}

std::size_t count_cells(const Reader& file, const Lattice& outline, int level) {
  const std::size_t count = count_cells(file, level);
  const std::size_t voxels = count_material(outline.segments),
                    most_voxels = count_in(outline.level(level).voxels_per_cell);
  const bool fits = count <= voxels && (voxels - 1) / most_voxels < count && (level > 0 || count == voxels);
  if (!fits)
    file.fail(
        fmt::format("has {} cells of up to {} voxels in '{}/cells', expected them to hold {} as in "
                    "'/segments/num_voxels'",
                    count, most_voxels, level_group(level), voxels));
  return count;
}

std::size_t count_elements(const Reader& file, const Lattice& outline, int level) {
  if (level == 0) return outline.materials.size();
  const std::size_t count = file.shape(children_name(level), 2)[0], cells = count_cells(file, outline, level);
  if (count > cells)
    file.fail(fmt::format("has {} elements in '{}', expected at most {} as cells", count, children_name(level), cells));
  return count;
}

std::vector<Level> read_merges(const Reader& file) {
  std::vector<Level> levels(as_size(count_levels(file)));
  for (int n = 0; n < static_cast<int>(levels.size()); ++n) {
    Level& level = levels[n];
    level.merge = read_index(file, level_group(n), "merge");
    level.voxels_per_cell = read_index(file, level_group(n), "voxels_per_cell");
    check_merge(file, levels, n);
    level.mixture = read_mixture(file, n);
    level.gaps = read_gaps(file, n);
  }
  return levels;
}

Lattice read_outline(const Reader& file) {
  std::vector<std::string> history = read_header(file, lattice_format, lattice_version, split_lattice_version);
  const Grid voxels = read_grid(file);
  std::vector<LatticeSegment> segments = read_segments(file, voxels);
  std::vector<VoxelMaterial> materials = read_materials(file, segments);
  Lattice lattice{voxels, {}, std::move(segments), std::move(materials), {}, {}, std::move(history)};
  lattice.surface_of_voxels = is_surface_of_voxels(file);
  lattice.parting = read_parting(file, lattice.segments);
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

std::vector<double> read_matrix_rows(const Reader& file, int level, const StoredMatrices::Set& set,
                                     std::size_t num_elements, std::size_t first, std::size_t count) {
  return file.read_rows<double>(matrix_name(level, set.name), {num_elements, set.width}, first, count);
}

bool has_matrices(const Reader& file, int level) {
  const StoredMatrices none;
  std::size_t count = 0;
  for (const StoredMatrices::Set& set : none.sets()) count += file.has(matrix_name(level, set.name));
  if (count != 0 && count != StoredMatrices::num_sets)
    file.fail(fmt::format("has {} of {} sets of matrices in '{}/elements', expected all or none", count,
                          StoredMatrices::num_sets, level_group(level)));
  return count != 0;
}

void read_matrices(const Reader& file, const Lattice& lattice, int number, Level& level,
                   const std::vector<std::int32_t>* numbers) {
  const std::size_t count = count_elements(file, lattice, number);
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
  check_masses(file, lattice, number, level);
  read_subcells(file, number, level, numbers);
}

}  // namespace hexmesh::hdf5
