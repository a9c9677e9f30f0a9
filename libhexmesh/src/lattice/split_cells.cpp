// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/split_cells.h"

#include <algorithm>

#include "hexmesh/lattice/lattice.h"

namespace hexmesh {

bool Parting::slide(std::uint16_t one, std::uint16_t other) const {
  return std::any_of(sliding.begin(), sliding.end(),
                     [&](const auto& pair) { return pair == std::pair(one, other) || pair == std::pair(other, one); });
}

std::int32_t VoxelOwners::of(std::int64_t voxel) const {
  const auto found = std::lower_bound(voxels.begin(), voxels.end(), voxel);
  return found != voxels.end() && *found == voxel ? cells[as_size(found - voxels.begin())] : -1;
}

std::int32_t SplitCells::copy(std::int32_t cell, int corner) const {
  const auto found = std::lower_bound(corners.begin(), corners.end(), 8 * std::int64_t{cell} + corner);
  const bool is_there = found != corners.end() && *found == 8 * std::int64_t{cell} + corner;
  return is_there ? copies[as_size(found - corners.begin())] : 0;
}

std::pair<std::int32_t, std::int32_t> cells_at(std::span<const Index3> cells, const Index3& index) {
  const auto first = std::lower_bound(cells.begin(), cells.end(), index, i_fastest);
  auto end = first;
  while (end != cells.end() && *end == index) ++end;
  return {static_cast<std::int32_t>(first - cells.begin()), static_cast<std::int32_t>(end - cells.begin())};
}

NodeNumbering number_nodes(std::span<const Index3> cells, const SplitCells& split) {
  NodeNumbering out = number_nodes(cells);
  if (split.corners.empty()) return out;
  std::vector<std::int32_t> first(out.nodes.size() + 1);  // first the copies of each index, then where its nodes begin
  for (std::size_t n = 0; n < split.corners.size(); ++n) {
    std::int32_t& most = first[as_size(out.cell_nodes[split.corners[n] / 8][split.corners[n] % 8]) + 1];
    most = std::max(most, split.copies[n]);
  }
  std::vector<Index3> nodes;
  for (std::size_t n = 0; n < out.nodes.size(); ++n) {
    nodes.insert(nodes.end(), as_size(first[n + 1]) + 1, out.nodes[n]);
    first[n + 1] = static_cast<std::int32_t>(nodes.size());
  }
  for (CellNodes& of_cell : out.cell_nodes)
    for (std::int32_t& node : of_cell) node = first[node];
  for (std::size_t n = 0; n < split.corners.size(); ++n)
    out.cell_nodes[split.corners[n] / 8][split.corners[n] % 8] += split.copies[n];
  out.nodes = std::move(nodes);
  return out;
}

std::size_t count_nodes(std::span<const Index3> cells, const SplitCells& split) {
  std::vector<std::pair<std::uint64_t, std::int32_t>> more;
  for (std::size_t n = 0; n < split.corners.size(); ++n)
    more.emplace_back(sort_key(corner_of(cells[split.corners[n] / 8], static_cast<int>(split.corners[n] % 8))),
                      split.copies[n]);
  std::sort(more.begin(), more.end());
  more.erase(std::unique(more.begin(), more.end()), more.end());
  return count_nodes(cells) + more.size();
}

NodeNumbering nodes_of(const Level& level) { return number_nodes(level.cells, level.split); }

std::int32_t coarser_cell_of(const Lattice& lattice, int number, std::int32_t cell, int coarser) {
  const Level &level = lattice.level(number), &above = lattice.level(coarser);
  const Index3 low = first_in(level.cells[as_size(cell)], level.voxels_per_cell);
  const auto [first, end] = cells_at(above.cells, coarser_index(low, above.voxels_per_cell));
  if (end - first <= 1) return first < end ? first : -1;
  const bool is_one_of_several = shares_index(level.cells, as_size(cell));
  Index3 high, v;
  for (std::size_t d = 0; d < 3; ++d) high[d] = std::min(low[d] + level.voxels_per_cell[d], lattice.voxels.extent()[d]);
  for (v[2] = low[2]; v[2] < high[2]; ++v[2])
    for (v[1] = low[1]; v[1] < high[1]; ++v[1])
      for (v[0] = low[0]; v[0] < high[0]; ++v[0]) {
        const auto voxel = static_cast<std::int64_t>(lattice.voxels.offset(v));
        if (is_one_of_several && level.split.owners.of(voxel) != cell) continue;
        if (const std::int32_t owner = above.split.owners.of(voxel); owner >= 0) return owner;
      }
  return -1;
}

std::vector<std::int32_t> coarser_cells_of(const Lattice& lattice, int number, int coarser) {
  const Level &level = lattice.level(number), &above = lattice.level(coarser);
  std::vector<std::int32_t> out;
  out.reserve(level.cells.size());
  for (std::size_t c = 0; c < level.cells.size(); ++c) {
    // Cells in a row mostly have the coarser one of the cell before.
    const Index3 low = first_in(level.cells[c], level.voxels_per_cell);
    const bool is_as_before = !out.empty() && out.back() >= 0 && !shares_index(above.cells, as_size(out.back())) &&
                              above.cells[as_size(out.back())] == coarser_index(low, above.voxels_per_cell);
    out.push_back(is_as_before ? out.back() : coarser_cell_of(lattice, number, static_cast<std::int32_t>(c), coarser));
  }
  return out;
}

}  // namespace hexmesh
