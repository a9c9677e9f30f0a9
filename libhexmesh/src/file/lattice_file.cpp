// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/file/lattice_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "hexmesh/core/error.h"
#include "hexmesh/file/lattice_reader.h"
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
  const Level& level = lattice.level(number);
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

std::string children_name(int level) { return level_group(level) + "/elements/children"; }

/// Children of a level's elements: within the finer level's, none in slots that the merge does not have.
/// @param values  as the file has them, eight for each element
std::vector<Children> to_children(const hdf5::Reader& file, const std::string& name,
                                  const std::vector<std::int32_t>& values, const Index3& merge, std::size_t num_finer) {
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

/// The rows of sorted numbers, read in blocks that hold some of them.
std::vector<std::int32_t> read_child_rows(const hdf5::Reader& file, const std::string& name,
                                          const std::vector<std::int32_t>& numbers) {
  constexpr hsize_t block_rows = 1 << 16;
  const hsize_t num_rows = file.shape(name, 2)[0];
  std::vector<std::int32_t> out;
  out.reserve(8 * numbers.size());
  for (std::size_t n = 0; n < numbers.size();) {
    const auto first = static_cast<hsize_t>(numbers[n]);
    const hsize_t count = std::min(block_rows, num_rows - first);
    const auto block = file.read_rows<std::int32_t>(name, {0, 8}, first, count);
    for (; n < numbers.size() && static_cast<hsize_t>(numbers[n]) < first + count; ++n) {
      const auto row = block.begin() + static_cast<std::ptrdiff_t>(8 * (static_cast<hsize_t>(numbers[n]) - first));
      out.insert(out.end(), row, row + 8);
    }
  }
  return out;
}

/// Replaces numbers by their places among the sorted numbers there are, which are returned; -1 stays.
template <class Numbers>
std::vector<std::int32_t> make_compact(Numbers&& numbers) {
  std::vector<std::int32_t> known;
  for (const std::int32_t n : numbers)
    if (n >= 0) known.push_back(n);
  std::sort(known.begin(), known.end());
  known.erase(std::unique(known.begin(), known.end()), known.end());
  for (std::int32_t& n : numbers)
    if (n >= 0) n = static_cast<std::int32_t>(std::lower_bound(known.begin(), known.end(), n) - known.begin());
  return known;
}

void check_order(const hdf5::Reader& file, const std::string& group, const std::vector<Index3>& cells) {
  if (std::adjacent_find(cells.begin(), cells.end(),
                         [&](const Index3& a, const Index3& b) { return !i_fastest(a, b); }) != cells.end())
    file.fail(fmt::format("has cells of '{}' twice or out of order", group));
}

void read_cells(const hdf5::Reader& file, const Grid& voxels, int number, Level& level) {
  const std::string group = level_group(number);
  level.cells = hdf5::read_cells(file, group + "/cells", coarser_extent(voxels.extent(), level.voxels_per_cell));
  if (level.cells.empty()) file.fail(fmt::format("has no cells in '{}'", group));
  check_order(file, group, level.cells);
  level.element = file.read<std::int32_t>(group + "/element", {level.cells.size()});
  hdf5::check_range(file, group + "/element", level.element, level.filled.size());
  level.segment = file.read<std::uint16_t>(group + "/segment", {level.cells.size()});
  level.parts = file.read<std::uint16_t>(group + "/parts", {level.cells.size()});
}

/// Each level merges one or two cells along each axis, and some axis.
void check_merge(const hdf5::Reader& file, const std::vector<Level>& levels, int n) {
  const Index3 one = {1, 1, 1}, finer = n > 0 ? levels[n - 1].voxels_per_cell : one;
  bool good = n > 0 ? levels[n].merge != one : levels[n].merge == one;
  for (std::size_t d = 0; d < 3; ++d)
    good &= levels[n].merge[d] <= 2 && levels[n].voxels_per_cell[d] == levels[n].merge[d] * finer[d];
  if (!good) file.fail(fmt::format("has a '{}' that does not merge the level before it", level_group(n)));
}

int count_levels(const hdf5::Reader& file) {
  int count = 0;
  while (file.has(level_group(count))) ++count;
  if (count == 0) file.fail("has no levels");
  return count;
}

/// All levels, with nothing but how they merge.
std::vector<Level> read_merges(const hdf5::Reader& file) {
  std::vector<Level> levels(as_size(count_levels(file)));
  for (int n = 0; n < static_cast<int>(levels.size()); ++n) {
    Level& level = levels[n];
    level.merge = hdf5::read_index(file, level_group(n), "merge");
    level.voxels_per_cell = hdf5::read_index(file, level_group(n), "voxels_per_cell");
    check_merge(file, levels, n);
  }
  return levels;
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
  for (int n = 0; n < lattice.num_levels(); ++n) write_level(file, lattice, n, tree);
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
  lattice.levels = read_merges(file);
  const int count = lattice.num_levels();
  const int coarsest = levels.empty() ? count - 1 : *std::max_element(levels.begin(), levels.end());
  for (int n = 1; n < count && n <= coarsest; ++n) {
    Level& level = lattice.level(n);
    const std::size_t num_finer = n == 1 ? lattice.materials.size() : lattice.levels[n - 1].children.size();
    level.children =
        to_children(file, children_name(n), file.read<std::int32_t>(children_name(n), {0, 8}), level.merge, num_finer);
  }
  count_filled(lattice.levels, lattice.materials.size());
  for (int n = 0; n < count; ++n)
    if (levels.empty() || std::find(levels.begin(), levels.end(), n) != levels.end())
      read_cells(file, lattice.voxels, n, lattice.level(n));
  return lattice;
}

LatticeReader::LatticeReader(const std::filesystem::path& path)
    : file_(std::make_unique<const hdf5::Reader>(path, "lattice")) {}
LatticeReader::~LatticeReader() = default;

Lattice LatticeReader::outline() const {
  std::vector<std::string> history = hdf5::read_header(*file_, lattice_format, lattice_version);
  std::vector<LatticeSegment> segments = hdf5::read_segments(*file_);
  std::vector<VoxelMaterial> materials = read_materials(*file_, segments);
  Lattice lattice{hdf5::read_grid(*file_), {}, std::move(segments), std::move(materials), {}, {}, std::move(history)};
  lattice.levels = read_merges(*file_);
  return lattice;
}

std::size_t LatticeReader::num_cells(int level) const {
  const std::size_t count = file_->shape(level_group(level) + "/cells", 2)[0];
  if (count == 0) file_->fail(fmt::format("has no cells in '{}'", level_group(level)));
  return count;
}

std::size_t LatticeReader::num_surface_points() const { return file_->shape("/surface/points", 2)[0]; }

std::vector<Vec3> LatticeReader::surface_points(std::size_t first, std::size_t count) const {
  const auto values = file_->read_rows<double>("/surface/points", {0, 3}, first, count);
  std::vector<Vec3> points;
  for (std::size_t n = 0; n < values.size(); n += 3) points.push_back(Vec3::Map(&values[n]));
  return points;
}

std::vector<std::uint64_t> LatticeReader::cells_in_layers(int level, std::size_t first, std::size_t count) const {
  const Index3 voxels_per_cell = hdf5::read_index(*file_, level_group(level), "voxels_per_cell");
  const Index3 layers = coarser_extent(hdf5::read_grid(*file_).extent(), voxels_per_cell);
  std::vector<std::uint64_t> out(as_size(layers[2]));
  for (const Index3& c : hdf5::read_cell_rows(*file_, level_group(level) + "/cells", layers, first, count)) ++out[c[2]];
  return out;
}

LatticePiece LatticeReader::read_layers(const Lattice& outline, int number,
                                        const std::vector<std::uint64_t>& first_rows, std::int32_t begin,
                                        std::int32_t end, std::int32_t margin) const {
  const Index3& voxels_per_cell = outline.level(number).voxels_per_cell;
  const Index3 layers = coarser_extent(outline.voxels.extent(), voxels_per_cell);
  const std::int32_t low = std::max(begin - margin, 0), high = std::min(end + margin, layers[2]);
  const auto row_of = [&](std::int32_t layer) { return first_rows[layer]; };
  const std::int32_t layer_voxels = voxels_per_cell[2];

  LatticePiece piece{outline, low, begin - low, end - low};
  piece.first_row = row_of(begin);
  piece.first_cell = row_of(begin) - row_of(low);
  piece.num_own_cells = row_of(end) - row_of(begin);
  const Index3& whole = outline.voxels.extent();
  const Index3 extent = {whole[0], whole[1], std::max(std::min(high * layer_voxels, whole[2]) - low * layer_voxels, 1)};
  piece.lattice.voxels = Grid(extent, outline.voxels.spacing(), outline.voxels.position(Vec3(0, 0, low * layer_voxels)),
                              outline.voxels.direction());
  const hsize_t voxel_layers = static_cast<hsize_t>(extent[2]);
  piece.lattice.labels = file_->read_rows<std::uint16_t>(
      "/voxels/labels",
      {static_cast<hsize_t>(whole[2]), static_cast<hsize_t>(whole[1]), static_cast<hsize_t>(whole[0])},
      static_cast<hsize_t>(std::min(low * layer_voxels, whole[2] - 1)), voxel_layers);

  Level& level = piece.lattice.level(number);
  const std::string group = level_group(number);
  const hsize_t first = row_of(low), count = row_of(high) - first;
  level.cells = hdf5::read_cell_rows(*file_, group + "/cells", layers, first, count);
  check_order(*file_, group, level.cells);
  for (Index3& c : level.cells) {
    c[2] -= low;
    if (c[2] < 0 || c[2] >= high - low) file_->fail(fmt::format("has cells of '{}' out of order", group));
  }
  level.element = file_->read_rows<std::int32_t>(group + "/element", {0}, first, count);
  level.segment = file_->read_rows<std::uint16_t>(group + "/segment", {0}, first, count);
  level.parts = file_->read_rows<std::uint16_t>(group + "/parts", {0}, first, count);
  return piece;
}

std::size_t LatticeReader::num_elements(int level, const Lattice& lattice) const {
  return level == 0 ? lattice.materials.size() : file_->shape(children_name(level), 2)[0];
}

void LatticeReader::read_elements(Lattice& lattice, int number, std::vector<std::int32_t>& elements) const {
  hdf5::check_range(*file_, level_group(number) + "/element", elements, num_elements(number, lattice));
  std::vector<std::int32_t> needed;
  if (number > 0) needed = make_compact(elements);
  for (int n = number; n > 0; --n) {
    Level& level = lattice.level(n);
    level.children.clear();
    if (needed.empty()) continue;
    level.children = to_children(*file_, children_name(n), read_child_rows(*file_, children_name(n), needed),
                                 level.merge, num_elements(n - 1, lattice));
    if (n > 1) needed = make_compact(std::span(level.children.front().data(), 8 * level.children.size()));
  }
  count_filled(lattice.levels, lattice.materials.size());
}

double stored_matrix_error(const std::filesystem::path& path, const Lattice& lattice) {
  const hdf5::Reader file(path, "lattice");
  ElementTree tree(lattice);
  double worst = 0;
  for (int n = 0; n < lattice.num_levels(); ++n) {
    const Level& level = lattice.level(n);
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
