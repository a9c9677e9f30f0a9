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

template <class T>
void check_ascending(const Reader& file, const std::string& name, const std::vector<T>& values, std::int64_t limit) {
  for (std::size_t n = 0; n < values.size(); ++n)
    if (values[n] < 0 || values[n] >= limit || (n > 0 && values[n] <= values[n - 1]))
      file.fail(
          fmt::format("has {} in row {} of '{}', expected numbers that ascend, below {}", values[n], n, name, limit));
}

/// Whether all nodes at an index have a cell: those between the first and the last too.
void check_copies(const Reader& file, const std::string& group, const SplitCells& split,
                  std::span<const Index3> cells) {
  struct Found {
    std::int32_t most = 0;
    std::vector<std::int32_t> copies;
  };
  std::map<std::uint64_t, Found> at;
  for (std::size_t n = 0; n < split.corners.size(); ++n) {
    if (split.copies[n] < 1 || split.copies[n] > most_cells_at_index)
      file.fail(fmt::format("has {} in row {} of '{}/copies', expected 1 to {}", split.copies[n], n, group,
                            most_cells_at_index));
    Found& found = at[sort_key(corner_of(cells[split.corners[n] / 8], static_cast<int>(split.corners[n] % 8)))];
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
  Parting out{file.attribute<std::int32_t>("/parting", "gaps", 1)[0] != 0, {}};
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

VoxelOwners read_owners(const Reader& file, const std::string& group, const Grid& voxels, const StoredCells& cells) {
  VoxelOwners out;
  std::vector<bool> is_owner(cells.cells.size());
  const auto shares = [&](std::size_t c) { return shares_index(cells.cells, c); };
  if (file.has(group + "/voxels")) {
    out.voxels = file.read<std::int64_t>(group + "/voxels", {0});
    check_ascending(file, group + "/voxels", out.voxels, static_cast<std::int64_t>(voxels.num_voxels()));
    out.cells = file.read<std::int32_t>(group + "/cells", {out.voxels.size()});
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

void write_split(Writer& file, const std::string& group, const SplitCells& split) {
  if (!split.corners.empty()) {
    file.write<std::int64_t>(group + "/corners", split.corners, {split.corners.size()}, true);
    file.write<std::int32_t>(group + "/copies", split.copies, {split.copies.size()}, true);
  }
  write_owners(file, group, split.owners);
}

SplitCells read_split(const Reader& file, const std::string& group, const Grid& voxels, const StoredCells& cells) {
  SplitCells out;
  if (file.has(group + "/corners")) {
    out.corners = file.read<std::int64_t>(group + "/corners", {0});
    check_ascending(file, group + "/corners", out.corners, static_cast<std::int64_t>(8 * cells.cells.size()));
    out.copies = file.read<std::int32_t>(group + "/copies", {out.corners.size()});
    check_copies(file, group, out, cells.cells);
  }
  out.owners = read_owners(file, group, voxels, cells);
  return out;
}

}  // namespace hexmesh::hdf5
