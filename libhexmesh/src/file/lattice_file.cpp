// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/file/lattice_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "face_groups.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/result_file.h"
#include "hexmesh/lattice/element_tree.h"
#include "lattice_groups.h"
#include "level_checks.h"
#include "split_groups.h"

namespace hexmesh {
namespace {

/// Whether a level's matrices are stored.
bool stores_matrices(const Lattice& lattice, int number, MatrixStorage storage) {
  constexpr std::size_t most_bytes_per_voxel = 60;  // of level 0, for one level
  if (storage == MatrixStorage::none) return false;
  if (storage == MatrixStorage::all && number > 0) return true;
  return lattice.level(number).filled.size() * StoredMatrices::bytes_per_element <=
         most_bytes_per_voxel * lattice.levels.front().cells.size();
}

/// Calls take(first, matrices) with the matrices of the elements from `first` on, a block at a time.
template <class Take>
void for_each_block(const Lattice& lattice, int level, ElementTree& tree, const Take& take) {
  constexpr std::size_t block = hdf5::matrix_block;
  const ElementMatrices matrices(lattice.cell_edges(level));
  const std::size_t count = lattice.level(level).filled.size();
  for (std::size_t first = 0; first < count; first += block) {
    StoredMatrices formed;
    for (std::size_t e = first; e < std::min(first + block, count); ++e)
      formed.append(matrices, tree.form(level, static_cast<std::int32_t>(e)));
    take(first, formed);
  }
}

void write_level(hdf5::Writer& file, const Lattice& lattice, int number, ElementTree& tree, MatrixStorage storage) {
  const Level& level = lattice.level(number);
  const std::string group = hdf5::level_group(number);
  file.attribute(group, "merge", std::span<const std::int32_t>(level.merge));
  file.attribute(group, "voxels_per_cell", std::span<const std::int32_t>(level.voxels_per_cell));
  file.attribute(group, "mixture", std::span<const double>(&level.mixture, 1));
  const std::array<double, 3> gaps = {level.gaps.open, level.gaps.closed, level.gaps.closed_finer};
  if (gaps != std::array<double, 3>{}) file.attribute(group, hdf5::gaps_name, std::span<const double>(gaps));
  hdf5::write_cells(file, group + "/cells", level.cells);
  hdf5::write_split(file, group + "/split", level.split);
  file.write<std::int32_t>(group + "/element", level.element, {level.cells.size()}, true);
  file.write<std::uint16_t>(group + "/segment", level.segment, {level.cells.size()}, true);
  file.write<std::uint16_t>(group + "/parts", level.parts, {level.cells.size()}, true);
  if (number > 0)
    file.write<std::int32_t>(group + "/elements/children", {level.children.front().data(), 8 * level.children.size()},
                             {level.children.size(), 8}, true);
  if (!stores_matrices(lattice, number, storage)) return;
  hdf5::write_subcells(file, number, level.subcells);
  hdf5::declare_matrices(file, number, level.filled.size());
  for_each_block(lattice, number, tree, [&](std::size_t first, const StoredMatrices& block) {
    hdf5::write_matrices(file, number, first, block);
  });
}

void read_cells(const hdf5::Reader& file, Lattice& lattice, int number) {
  Level& level = lattice.level(number);
  const std::string group = hdf5::level_group(number), name = group + "/cells";
  hdf5::count_cells(file, lattice, number);
  level.cells = hdf5::read_cells(file, name, coarser_extent(lattice.voxels.extent(), level.voxels_per_cell),
                                 lattice.parting.any());
  hdf5::check_box(file, lattice.voxels, lattice.segments, {name, level.cells, level.voxels_per_cell});
  if (lattice.parting.any())
    level.split = hdf5::read_split(file, group + "/split", lattice.voxels, {name, level.cells, level.voxels_per_cell});
  level.element = file.read<std::int32_t>(group + "/element", {level.cells.size()});
  hdf5::check_range(file, group + "/element", level.element, level.filled.size());
  level.segment = file.read<std::uint16_t>(group + "/segment", {level.cells.size()});
  level.parts = file.read<std::uint16_t>(group + "/parts", {level.cells.size()});
}

}  // namespace

void write_lattice(const Lattice& lattice, const std::filesystem::path& path, MatrixStorage storage) {
  hdf5::Writer file(path);
  file.begin_checksum();
  hdf5::write_header(file, lattice_format, lattice.parting.any() ? split_lattice_version : lattice_version,
                     lattice.history);
  hdf5::write_parting(file, lattice.parting);
  hdf5::write_voxels(file, lattice.voxels, lattice.labels);
  hdf5::write_segments(file, lattice.segments);
  hdf5::write_surface(file, lattice.surface, lattice.surface_of_voxels);
  hdf5::write_faces(file, *faces_of(lattice));
  hdf5::write_materials(file, lattice.materials);
  ElementTree tree(lattice);
  for (int n = 0; n < lattice.num_levels(); ++n) write_level(file, lattice, n, tree, storage);
  file.attribute("/", "sha256", file.checksum());
  file.close();
}

Lattice read_lattice(const std::filesystem::path& path, const std::vector<int>& levels, Elements elements,
                     Voxels voxels) {
  const hdf5::Reader file(path, "lattice");
  Lattice lattice = hdf5::read_outline(file);
  const int count = lattice.num_levels();
  const auto is_wanted = [&](int n) {
    return levels.empty() || std::find(levels.begin(), levels.end(), n) != levels.end();
  };
  int formed = 0;  // the coarsest level whose elements are formed from their children
  for (int n = 0; n < count; ++n)
    if (is_wanted(n) && (elements == Elements::formed || !hdf5::has_matrices(file, n))) formed = n;
  for (int n = 1; n <= formed; ++n) {
    Level& level = lattice.level(n);
    const std::size_t num_finer = n == 1 ? lattice.materials.size() : lattice.levels[n - 1].children.size();
    level.children = hdf5::to_children(
        file, n, file.read<std::int32_t>(hdf5::children_name(n), {hdf5::count_elements(file, lattice, n), 8}),
        level.merge, num_finer);
  }
  count_filled(lattice.levels, lattice.materials.size());
  for (int n = 0; n < count; ++n) {
    if (!is_wanted(n)) continue;
    if (elements == Elements::stored && hdf5::has_matrices(file, n))
      hdf5::read_matrices(file, lattice, n, lattice.level(n));
    read_cells(file, lattice, n);
  }
  // After the cells, which tell a box that is too large before it takes memory.
  if (voxels == Voxels::read) lattice.labels = hdf5::read_labels(file, lattice.voxels);
  if (voxels != Voxels::left_out) lattice.surface = hdf5::read_surface(file);
  hdf5::validate(file, lattice);
  lattice.faces = hdf5::open_faces(path, lattice);
  return lattice;
}

std::optional<double> stored_matrix_error(const std::filesystem::path& path, const Lattice& lattice, int level) {
  const hdf5::Reader file(path, "lattice");
  if (!hdf5::has_matrices(file, level)) return std::nullopt;
  ElementTree tree(lattice);
  std::array<double, StoredMatrices::num_sets> difference{}, largest{};
  const auto take_larger = [](double& most, double value) {
    if (!(value <= most)) most = std::isnan(value) ? std::numeric_limits<double>::infinity() : value;
  };
  const std::size_t count = lattice.level(level).filled.size();
  for_each_block(lattice, level, tree, [&](std::size_t first, const StoredMatrices& formed) {
    for (std::size_t k = 0; k < difference.size(); ++k) {
      const StoredMatrices::Set& set = formed.sets()[k];
      const std::vector<double> stored = hdf5::read_matrix_rows(file, level, set, count, first, formed.size());
      for (std::size_t i = 0; i < stored.size(); ++i) {
        take_larger(difference[k], std::abs(stored[i] - set.values[i]));
        take_larger(largest[k], std::abs(set.values[i]));
      }
    }
  });
  double worst = 0;
  for (std::size_t k = 0; k < difference.size(); ++k)
    if (difference[k] > 0) take_larger(worst, difference[k] / largest[k]);
  return worst;
}

std::vector<bool> levels_with_matrices(const std::filesystem::path& path) {
  const hdf5::Reader file(path, "lattice");
  hdf5::read_header(file, lattice_format, lattice_version, split_lattice_version);
  std::vector<bool> out(as_size(hdf5::count_levels(file)));
  for (std::size_t n = 0; n < out.size(); ++n) out[n] = hdf5::has_matrices(file, static_cast<int>(n));
  return out;
}

std::string content_checksum(const std::filesystem::path& path) {
  const hdf5::Reader file(path, "lattice");
  std::string digits = file.text_attribute("/", "sha256");
  if (digits.size() != 64 || digits.find_first_not_of("0123456789abcdef") != std::string::npos)
    file.fail("has an attribute 'sha256' that is none, expected 64 hexadecimal digits");
  return digits;
}

std::string format_of(const std::filesystem::path& path) {
  const hdf5::Reader file(path, "input");
  std::string format = file.text_attribute("/", "format");
  if (format != lattice_format && format != result_format)
    file.fail(fmt::format("is a '{}' file, expected a '{}' or a '{}'", format, lattice_format, result_format));
  return format;
}

std::vector<std::size_t> cells_of_levels(const std::filesystem::path& path) {
  const hdf5::Reader file(path, "lattice");
  hdf5::read_header(file, lattice_format, lattice_version, split_lattice_version);
  std::vector<std::size_t> counts;
  for (int n = 0; n < hdf5::count_levels(file); ++n) counts.push_back(hdf5::count_cells(file, n));
  return counts;
}

}  // namespace hexmesh
