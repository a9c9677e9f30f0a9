// SPDX-License-Identifier: Apache-2.0
#include "split_groups.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "shared_groups.h"

namespace hexmesh::hdf5 {
namespace {

constexpr const char* sliding_name = "/parting/sliding";
constexpr std::int32_t most_cells_at_index = 32768;

/// Rows whose numbers ascend, each with a value.
struct NumberedRows {
  std::vector<std::int64_t> numbers;
  std::vector<std::int32_t> values;
};

/// Those of `begin` to `end` - 1, less `begin`: no more of the others is held than some rows at a time.
NumberedRows read_rows(const Reader& file, const std::string& numbers, const std::string& values, std::int64_t limit,
                       std::int64_t begin, std::int64_t end) {
  constexpr hsize_t block_rows = 1 << 18;
  NumberedRows out;
  std::int64_t last = -1;
  file.read_in_blocks<std::int64_t>(
      numbers, {0}, block_rows, [&](const std::vector<std::int64_t>& block, hsize_t first) {
        const auto of_block = file.read_rows<std::int32_t>(values, {file.shape(numbers, 1)[0]}, first, block.size());
        for (std::size_t n = 0; n < block.size(); ++n) {
          if (block[n] <= last || block[n] >= limit)
            file.fail(fmt::format("has {} in row {} of '{}', expected numbers that ascend, below {}", block[n],
                                  first + n, numbers, limit));
          last = block[n];
          if (last < begin || last >= end) continue;
          out.numbers.push_back(last - begin);
          out.values.push_back(of_block[n]);
        }
      });
  return out;
}

/// Whether all nodes at an index have a cell: those between the first and the last too.
/// @param is_inside  index of a node -> whether all cells around it are there
template <class IsInside>
void check_copies(const Reader& file, const std::string& group, const SplitCells& split, std::span<const Index3> cells,
                  const IsInside& is_inside) {
  struct Found {
    std::int32_t most = 0;
    std::vector<std::int32_t> copies;
  };
  std::map<std::uint64_t, Found> at;
  for (std::size_t n = 0; n < split.corners.size(); ++n) {
    if (split.copies[n] < 1 || split.copies[n] > most_cells_at_index)
      file.fail(fmt::format("has {} in row {} of '{}/copies', expected 1 to {}", split.copies[n], n, group,
                            most_cells_at_index));
    const Index3 index = corner_of(cells[split.corners[n] / 8], static_cast<int>(split.corners[n] % 8));
    if (!is_inside(index)) continue;
    Found& found = at[sort_key(index)];
    found.most = std::max(found.most, split.copies[n]);
    found.copies.push_back(split.copies[n]);
  }
  for (auto& [key, found] : at) {
    std::sort(found.copies.begin(), found.copies.end());
    const auto end = std::unique(found.copies.begin(), found.copies.end());
    if (end - found.copies.begin() != found.most)
      file.fail(fmt::format("has node {} of an index in '{}/copies' but not all before it", found.most, group));
  }
}

}  // namespace

void write_parting(Writer& file, const Parting& parting) {
  if (!parting.any()) return;
  const std::int32_t gaps = parting.gaps ? 1 : 0;
  std::vector<std::uint16_t> sliding;
  for (const auto& [one, other] : parting.sliding) sliding.insert(sliding.end(), {one, other});
  file.write<std::uint16_t>(sliding_name, sliding, {parting.sliding.size(), 2});
  file.attribute("/parting", "gaps", std::span(&gaps, 1));
}

Parting read_parting(const Reader& file, const std::vector<LatticeSegment>& segments) {
  if (!file.has("/parting")) return {};
  const std::int32_t gaps = file.attribute<std::int32_t>("/parting", "gaps", 1)[0];
  if (gaps != 0 && gaps != 1) file.fail(fmt::format("has {} in 'gaps' of '/parting', expected 0 or 1", gaps));
  Parting out{gaps == 1, {}};
  const auto labels = file.read<std::uint16_t>(sliding_name, {0, 2});
  check_segments(file, sliding_name, labels, segments, LabelKind::with_material);
  for (std::size_t n = 0; n < labels.size(); n += 2) out.sliding.emplace_back(labels[n], labels[n + 1]);
  if (!out.any()) file.fail("has '/parting' that parts nothing, expected gaps or segments that slide");
  return out;
}

void write_owners(Writer& file, const std::string& group, const VoxelOwners& owners) {
  if (owners.empty()) return;
  file.write<std::int64_t>(group + "/voxels", owners.voxels, {owners.voxels.size()}, true);
  file.write<std::int32_t>(group + "/cells", owners.cells, {owners.cells.size()}, true);
}

VoxelOwners read_owners(const Reader& file, const std::string& group, const Grid& voxels, const StoredCells& cells,
                        const std::optional<PieceOfLevel>& piece) {
  VoxelOwners out;
  std::vector<bool> is_owner(cells.cells.size());
  const auto shares = [&](std::size_t c) { return shares_index(cells.cells, c); };
  if (file.has(group + "/voxels")) {
    const Grid& whole = piece ? piece->voxels : voxels;
    const std::int64_t begin = piece ? static_cast<std::int64_t>(whole.offset({0, 0, piece->first_layer})) : 0;
    NumberedRows rows =
        read_rows(file, group + "/voxels", group + "/cells", static_cast<std::int64_t>(whole.num_voxels()), begin,
                  begin + static_cast<std::int64_t>(voxels.num_voxels()));
    out = {std::move(rows.numbers), std::move(rows.values)};
    if (piece)
      for (std::int32_t& cell : out.cells) cell -= static_cast<std::int32_t>(piece->first_cell);
    check_range(file, group + "/cells", out.cells, cells.cells.size());
    for (std::size_t n = 0; n < out.voxels.size(); ++n) {
      const std::size_t c = as_size(out.cells[n]);
      const Index3 index = coarser_index(voxels.index(as_size(out.voxels[n])), cells.voxels_per_cell);
      if (!shares(c) || cells.cells[c] != index)
        file.fail(fmt::format("has cell {} for voxel {} in '{}', expected one of several at {}",
                              text_of(cells.cells[c]), text_of(voxels.index(as_size(out.voxels[n]))), group,
                              text_of(index)));
      is_owner[c] = true;
    }
  }
  for (std::size_t c = 0; c < cells.cells.size(); ++c)
    if (shares(c) && !is_owner[c])
      file.fail(fmt::format("has cell {} twice or more in '{}', but no voxel of row {} in '{}'",
                            text_of(cells.cells[c]), cells.name, c, group));
  return out;
}

VoxelOwners read_all_owners(const Reader& file, const std::string& group, const Grid& voxels, std::size_t num_cells) {
  if (!file.has(group + "/voxels")) return {};
  const auto limit = static_cast<std::int64_t>(voxels.num_voxels());
  NumberedRows rows = read_rows(file, group + "/voxels", group + "/cells", limit, 0, limit);
  check_range(file, group + "/cells", rows.values, num_cells);
  return {std::move(rows.numbers), std::move(rows.values)};
}

void write_split(Writer& file, const std::string& group, const SplitCells& split) {
  if (!split.corners.empty()) {
    file.write<std::int64_t>(group + "/corners", split.corners, {split.corners.size()}, true);
    file.write<std::int32_t>(group + "/copies", split.copies, {split.copies.size()}, true);
  }
  write_owners(file, group, split.owners);
}

SplitCells read_split(const Reader& file, const std::string& group, const Grid& voxels, const StoredCells& cells,
                      const std::optional<PieceOfLevel>& piece) {
  SplitCells out;
  if (file.has(group + "/corners")) {
    const std::size_t first = piece ? piece->first_cell : 0, all = piece ? piece->num_cells : cells.cells.size();
    NumberedRows rows =
        read_rows(file, group + "/corners", group + "/copies", 8 * static_cast<std::int64_t>(all),
                  8 * static_cast<std::int64_t>(first), 8 * static_cast<std::int64_t>(first + cells.cells.size()));
    out.corners = std::move(rows.numbers);
    out.copies = std::move(rows.values);
    const std::int32_t layers = coarser_extent(voxels.extent(), cells.voxels_per_cell)[2];
    check_copies(file, group, out, cells.cells,
                 [&](const Index3& node) { return !piece || (node[2] > 0 && node[2] < layers); });
  }
  out.owners = read_owners(file, group, voxels, cells, piece);
  return out;
}

}  // namespace hexmesh::hdf5
