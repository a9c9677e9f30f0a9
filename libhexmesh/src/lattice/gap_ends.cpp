// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/gap_ends.h"

#include <algorithm>
#include <optional>

#include "hexmesh/lattice/merge.h"

namespace hexmesh {
namespace {

/// Which corner of a cell is at an index of nodes, if one is.
std::optional<int> corner_at(const Index3& cell, const Index3& node) {
  int corner = 0;
  for (int d = 0; d < 3; ++d) {
    const std::int32_t upper = node[as_size(d)] - cell[as_size(d)];
    if (upper < 0 || upper > 1) return std::nullopt;
    corner |= upper << d;
  }
  return corner;
}

/// Whether two cells move alike at a place on the border of both: all nodes by which they do are of both.
/// @param weights  of the nodes of the first there
bool move_alike(const Level& level, std::int32_t one, std::int32_t other, const NodeWeights& weights) {
  if (one == other) return true;
  for (int corner = 0; corner < 8; ++corner) {
    if (weights[corner] == 0) continue;
    const std::optional<int> there =
        corner_at(level.cells[as_size(other)], corner_of(level.cells[as_size(one)], corner));
    if (!there || level.split.copy(one, corner) != level.split.copy(other, *there)) return false;
  }
  return true;
}

/// Calls f(cell, corner) with those of cells of a level at an index of nodes.
template <class F>
void for_each_corner_at(const Level& level, const Index3& node, F&& f) {
  for (int corner = 0; corner < 8; ++corner) {
    Index3 index = node;
    for (int d = 0; d < 3; ++d) index[as_size(d)] -= corner_bit(corner, d);
    if (*std::min_element(index.begin(), index.end()) < 0) continue;
    const auto [first, end] = cells_at(level.cells, index);
    for (std::int32_t c = first; c < end; ++c) f(c, corner);
  }
}

}  // namespace

std::vector<bool> cells_where_gaps_end(const Lattice& lattice, int level) {
  const Level &above = lattice.level(level), &below = lattice.level(level - 1);
  std::vector<bool> out(above.cells.size());
  const std::vector<std::int64_t>& corners = below.split.corners;
  if (corners.empty()) return out;
  const std::vector<std::int32_t> parents = coarser_cells_of(lattice, level - 1, level);
  for (std::size_t n = 0; n < corners.size(); ++n) {
    const auto cell = static_cast<std::size_t>(corners[n] / 8);
    const auto own_corner = static_cast<int>(corners[n] % 8);
    const Index3 node = corner_of(below.cells[cell], own_corner);
    const NodeWeights weights =
        weights_in_parent(slot_in_parent(below.cells[cell], above.merge), own_corner, above.merge);
    for_each_corner_at(below, node, [&](std::int32_t c, int corner) {
      if (below.split.copy(c, corner) != below.split.copies[n] &&
          move_alike(above, parents[cell], parents[as_size(c)], weights))
        out[as_size(parents[cell])] = out[as_size(parents[as_size(c)])] = true;
    });
  }
  return out;
}

std::vector<bool> cells_round_gap_ends(const Level& level) {
  std::vector<bool> out(level.cells.size());
  const auto copy = [&](std::int32_t c, int corner) { return level.split.copy(c, corner); };
  for (std::size_t n = 0; n < level.split.corners.size(); ++n) {
    const auto cell = static_cast<std::int32_t>(level.split.corners[n] / 8);
    const auto apart = static_cast<int>(level.split.corners[n] % 8);
    const Index3& index = level.cells[as_size(cell)];
    for_each_corner_at(level, corner_of(index, apart), [&](std::int32_t other, int there) {
      if (copy(other, there) == level.split.copies[n]) return;
      for (int corner = 0; corner < 8; ++corner) {
        const Index3 node = corner_of(index, corner);
        const std::optional<int> same = corner_at(level.cells[as_size(other)], node);
        if (!same || copy(cell, corner) != copy(other, *same)) continue;
        for_each_corner_at(level, node, [&](std::int32_t c, int a) {
          if (copy(c, a) == copy(cell, corner)) out[as_size(c)] = true;
        });
      }
    });
  }
  return out;
}

}  // namespace hexmesh
