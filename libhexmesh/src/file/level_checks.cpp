// SPDX-License-Identifier: Apache-2.0
#include "level_checks.h"

#include <fmt/format.h>

#include <algorithm>

#include "bounds.h"
#include "lattice_groups.h"

namespace hexmesh::hdf5 {
namespace {

bool is_read(const Lattice& lattice, int level) { return !lattice.level(level).cells.empty(); }

/// The segments that the elements of a level hold, a bit each; segments 64 apart share one. Empty where the file gives
/// matrices in place of children.
std::vector<std::uint64_t> segments_in_elements(const Lattice& lattice, int number,
                                                const std::vector<std::uint64_t>& bit_of_label) {
  std::vector<std::uint64_t> bits;
  for (const VoxelMaterial& m : lattice.materials) bits.push_back(bit_of_label[m.label]);
  for (int n = 1; n <= number; ++n) {
    const std::vector<Children>& children = lattice.level(n).children;
    if (children.empty()) return {};
    std::vector<std::uint64_t> coarser(children.size());
    for (std::size_t e = 0; e < children.size(); ++e)
      for (const std::int32_t child : children[e])
        if (child >= 0) coarser[e] |= bits[child];
    bits = std::move(coarser);
  }
  return bits;
}

/// Rows of cells of the same j and k, which lie one after the other.
class CellRows {
public:
  CellRows(std::span<const Index3> cells, const Index3& extent)
      : ny_(as_size(extent[1])), begin_(ny_ * as_size(extent[2]) + 1) {
    for (const Index3& c : cells) ++begin_[row(c) + 1];
    for (std::size_t r = 1; r < begin_.size(); ++r) begin_[r] += begin_[r - 1];
  }
  std::size_t row(const Index3& c) const { return as_size(c[1]) + ny_ * as_size(c[2]); }
  std::size_t begin(std::size_t row) const { return begin_[row]; }

private:
  std::size_t ny_;
  std::vector<std::size_t> begin_;
};

std::vector<std::uint8_t> count_children(const std::vector<Children>& children) {
  std::vector<std::uint8_t> count(children.size());
  for (std::size_t e = 0; e < children.size(); ++e)
    count[e] = static_cast<std::uint8_t>(8 - std::count(children[e].begin(), children[e].end(), -1));
  return count;
}

std::size_t slot_of(const Index3& cell, const Index3& merge) {
  std::size_t slot = 0;
  for (std::size_t d = 0; d < 3; ++d) slot |= as_size(cell[d] % merge[d]) << d;
  return slot;
}

void check_levels(const Reader& file, const Lattice& lattice) {
  for (int n = 0; n < lattice.num_levels(); ++n) {
    if (!is_read(lattice, n)) continue;
    check_cells_of_level(file, lattice, n);
    check_filled(file, lattice, n);
    if (n > 0 && is_read(lattice, n - 1)) check_parents(file, lattice, n);
  }
}

}  // namespace

void check_cells_of_level(const Reader& file, const Lattice& lattice, int number) {
  const Level& level = lattice.level(number);
  const std::string group = level_group(number);
  check_segments(file, group + "/segment", level.segment, lattice.segments, LabelKind::with_material);
  std::vector<std::uint64_t> bit_of_label(65536);
  for (std::size_t s = 0; s < lattice.segments.size(); ++s)
    bit_of_label[lattice.segments[s].segment.label] = std::uint64_t{1} << s % 64;
  const std::vector<std::uint64_t> bits = segments_in_elements(lattice, number, bit_of_label);
  bool is_good = true;
  const auto holds_segment = [&](std::size_t c) {
    return bits.empty() || (bits[level.element[c]] & bit_of_label[level.segment[c]]) != 0;
  };
  const auto has_parts = [&](std::size_t c) {
    return level.parts[c] > 0 && level.parts[c] <= level.filled[level.element[c]];
  };
  for (std::size_t c = 0; c < level.cells.size(); ++c) is_good &= holds_segment(c) && has_parts(c);
  if (is_good) return;
  for (std::size_t c = 0; c < level.cells.size(); ++c) {
    if (!holds_segment(c))
      file.fail(fmt::format("has label {} for cell {} in '{}/segment', which none of the voxels of its element has",
                            level.segment[c], text_of(level.cells[c]), group));
    if (!has_parts(c))
      file.fail(fmt::format("has {} parts for cell {} in '{}/parts', expected 1 to its {} voxels", level.parts[c],
                            text_of(level.cells[c]), group, level.filled[level.element[c]]));
  }
}

void check_filled(const Reader& file, const Lattice& lattice, int number) {
  const Level& level = lattice.level(number);
  std::int64_t found = 0;
  for (const std::int32_t e : level.element) found += level.filled[e];
  const std::size_t expected = count_material(lattice.segments);
  if (found < 0 || as_size(found) != expected)
    file.fail(fmt::format("has elements of {} voxels in all in '{}/element', expected {} as in '/segments/num_voxels'",
                          found, level_group(number), expected));
}

void check_parents(const Reader& file, const Lattice& lattice, int number) {
  const Level &fine = lattice.level(number - 1), &coarse = lattice.level(number);
  const std::string group = level_group(number);
  const CellRows rows(coarse.cells, coarser_extent(lattice.voxels.extent(), coarse.voxels_per_cell));
  const bool has_children = !coarse.children.empty();
  std::vector<char> is_parent(coarse.cells.size(), 0);
  std::size_t row = 0, next = 0, end = 0;
  std::int32_t last = 0;
  for (std::size_t c = 0; c < fine.cells.size(); ++c) {
    const Index3 parent = coarser_index(fine.cells[c], coarse.merge);
    // Along a row of finer cells the parents come in order too.
    if (const std::size_t of = rows.row(parent); c == 0 || of != row || parent[0] < last) {
      row = of;
      next = rows.begin(row);
      end = rows.begin(row + 1);
    }
    last = parent[0];
    while (next < end && coarse.cells[next][0] < parent[0]) ++next;
    if (next == end || coarse.cells[next][0] != parent[0])
      file.fail(fmt::format("has no cell {} in '{}/cells', expected it around cell {} of '{}'", text_of(parent), group,
                            text_of(fine.cells[c]), level_group(number - 1)));
    // Of several at one index, each that the cell may be in.
    std::int32_t child = fine.element[c];
    bool is_child = false;
    for (std::size_t p = next; p < end && coarse.cells[p] == parent; ++p) {
      if (has_children) child = coarse.children[coarse.element[p]][slot_of(fine.cells[c], coarse.merge)];
      if (child != fine.element[c]) continue;
      is_child = true;
      is_parent[p] = 1;
    }
    if (!is_child)
      file.fail(fmt::format("has element {} in cell {} of '{}', expected {}, the child of its parent's element {}",
                            fine.element[c], text_of(fine.cells[c]), level_group(number - 1), child,
                            coarse.element[next]));
  }
  if (const auto lonely = std::find(is_parent.begin(), is_parent.end(), 0); lonely != is_parent.end())
    file.fail(fmt::format("has a cell {} in '{}/cells' without a cell of '{}' in it",
                          text_of(coarse.cells[static_cast<std::size_t>(lonely - is_parent.begin())]), group,
                          level_group(number - 1)));
  if (!has_children) return;
  const std::vector<std::uint8_t> count = count_children(coarse.children);
  std::size_t expected = 0;
  for (const std::int32_t e : coarse.element) expected += count[e];
  if (expected != fine.cells.size())
    file.fail(fmt::format("has {} cells in '{}', expected {}, the children of the elements of '{}'", fine.cells.size(),
                          level_group(number - 1), expected, group));
}

void validate(const Reader& file, const Lattice& lattice) {
  check_levels(file, lattice);
  if (!lattice.labels.empty()) {
    const auto finest = std::find_if(lattice.levels.begin(), lattice.levels.end(),
                                     [](const Level& level) { return !level.cells.empty(); });
    StoredCells cells;
    if (finest != lattice.levels.end())
      cells = {level_group(static_cast<int>(finest - lattice.levels.begin())) + "/cells", finest->cells,
               finest->voxels_per_cell};
    check_counts(file, check_labels(file, lattice.voxels, lattice.labels, lattice.segments, cells), lattice.segments);
    if (cells.voxels_per_cell == Index3{1, 1, 1})
      for (std::size_t c = 0; c < cells.cells.size(); ++c)
        if (lattice.labels[lattice.voxels.offset(cells.cells[c])] != finest->segment[c])
          file.fail(fmt::format("has label {} for cell {} in '/levels/0/segment', expected {} as in '/voxels/labels'",
                                finest->segment[c], text_of(cells.cells[c]),
                                lattice.labels[lattice.voxels.offset(cells.cells[c])]));
  }
  check_places(file, "/surface/points", lattice.surface.points, lattice.voxels);
  check_segments(file, "/surface/segment", lattice.surface.segment, lattice.segments, LabelKind::without_material);
}

}  // namespace hexmesh::hdf5
