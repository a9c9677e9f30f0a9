// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/split_cells.h"

#include <algorithm>

#include "hexmesh/lattice/lattice.h"
#include "hexmesh/lattice/locator.h"

namespace hexmesh {

bool Parting::slide(std::uint16_t one, std::uint16_t other) const {
  return std::any_of(sliding.begin(), sliding.end(),
                     [&](const auto& pair) { return pair == std::pair(one, other) || pair == std::pair(other, one); });
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

std::vector<std::int32_t> coarser_cells_of(const Lattice& lattice, int number, int coarser) {
  const Level &level = lattice.level(number), &above = lattice.level(coarser);
  const CellLocator locator(lattice.voxels, level.voxels_per_cell, level.cells, level.split.owners);
  const CellLocator coarser_at(lattice.voxels, above.voxels_per_cell, above.cells);
  std::vector<std::int32_t> out;
  for (const Index3& cell : level.cells) {
    Index3 first;
    for (std::size_t d = 0; d < 3; ++d) first[d] = cell[d] * level.voxels_per_cell[d];
    out.push_back(coarser_at.cell_of_voxel(first));
  }
  const VoxelOwners& owners = above.split.owners;
  for (std::size_t n = 0; n < owners.voxels.size(); ++n)
    out[as_size(locator.cell_of_voxel(lattice.voxels.index(as_size(owners.voxels[n]))))] = owners.cells[n];
  return out;
}

}  // namespace hexmesh
