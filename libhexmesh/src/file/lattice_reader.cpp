// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/file/lattice_reader.h"

#include <fmt/format.h>

#include <algorithm>

#include "cell_checks.h"
#include "hexmesh/file/lattice_file.h"
#include "lattice_groups.h"
#include "split_groups.h"

namespace hexmesh {

using hdf5::children_name;
using hdf5::level_group;

namespace {

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

}  // namespace

LatticeReader::LatticeReader(const std::filesystem::path& path, Elements elements)
    : file_(std::make_unique<const hdf5::Reader>(path, "lattice")), source_(elements) {}
LatticeReader::~LatticeReader() = default;

Lattice LatticeReader::outline() const { return hdf5::read_outline(*file_); }

std::size_t LatticeReader::num_cells(int level) const { return hdf5::count_cells(*file_, level); }

std::vector<std::uint64_t> LatticeReader::cells_in_layers(int level, std::size_t first, std::size_t count) const {
  const Index3 voxels_per_cell = hdf5::read_index(*file_, level_group(level), "voxels_per_cell");
  const Index3 layers = coarser_extent(hdf5::read_grid(*file_).extent(), voxels_per_cell);
  std::vector<std::uint64_t> out(as_size(layers[2]));
  for (const Index3& c : hdf5::read_cell_rows(*file_, level_group(level) + "/cells", layers, first, count, true))
    ++out[c[2]];
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

  LatticePiece piece{outline, low, begin - low, end - low, high - low};
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
  level.cells = hdf5::read_cell_rows(*file_, group + "/cells", layers, first, count, outline.parting.any());
  for (Index3& c : level.cells) {
    c[2] -= low;
    if (c[2] < 0 || c[2] >= high - low) file_->fail(fmt::format("has cells of '{}' out of order", group));
  }
  level.element = file_->read_rows<std::int32_t>(group + "/element", {0}, first, count);
  level.segment = file_->read_rows<std::uint16_t>(group + "/segment", {0}, first, count);
  level.parts = file_->read_rows<std::uint16_t>(group + "/parts", {0}, first, count);
  hdf5::check_segments(*file_, group + "/segment", level.segment, outline.segments, hdf5::LabelKind::with_material);
  const hdf5::StoredCells cells{group + "/cells", level.cells, voxels_per_cell};
  hdf5::check_labels(*file_, piece.lattice.voxels, piece.lattice.labels, outline.segments, cells);
  if (outline.parting.any())
    level.split = hdf5::read_split(*file_, group + "/split", piece.lattice.voxels, cells,
                                   hdf5::PieceOfLevel{outline.voxels, low * layer_voxels, first, first_rows.back()});
  return piece;
}

VoxelOwners LatticeReader::owners(int level) const {
  return hdf5::read_all_owners(*file_, level_group(level) + "/split", hdf5::read_grid(*file_), num_cells(level));
}

std::size_t LatticeReader::num_elements(int level, const Lattice& lattice) const {
  return level == 0 ? lattice.materials.size() : file_->shape(children_name(level), 2)[0];
}

void LatticeReader::read_elements(Lattice& lattice, int number, std::vector<std::int32_t>& elements) const {
  hdf5::check_range(*file_, level_group(number) + "/element", elements, num_elements(number, lattice));
  std::vector<std::int32_t> needed;
  if (number > 0) needed = make_compact(elements);
  for (int n = 1; n <= number; ++n) lattice.level(n).children.clear();
  if (source_ == Elements::stored && hdf5::has_matrices(*file_, number)) {
    count_filled(lattice.levels, lattice.materials.size());
    hdf5::read_matrices(*file_, lattice, number, lattice.level(number), number > 0 ? &needed : nullptr);
    return;
  }
  for (int n = number; n > 0; --n) {
    Level& level = lattice.level(n);
    if (needed.empty()) continue;
    level.children =
        hdf5::to_children(*file_, n, hdf5::read_selected_rows<std::int32_t>(*file_, children_name(n), 8, needed),
                          level.merge, num_elements(n - 1, lattice));
    if (n > 1) needed = make_compact(std::span(level.children.front().data(), 8 * level.children.size()));
  }
  count_filled(lattice.levels, lattice.materials.size());
}

}  // namespace hexmesh
