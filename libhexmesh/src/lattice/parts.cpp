// SPDX-License-Identifier: Apache-2.0
#include "parts.h"

#include <algorithm>

#include "hexmesh/core/partition.h"
#include "hexmesh/lattice/locator.h"

namespace hexmesh {
namespace {

/// Joins the pieces of the finer level's cells across the planes where these meet inside the cells of a level.
class LevelJoiner {
public:
  LevelJoiner(const Level& level, const CellLocator& cell_at, const Level& voxels, const CellLocator& voxel_at,
              Partition& pieces)
      : level_(level), cell_at_(cell_at), voxels_(voxels), voxel_at_(voxel_at), pieces_(pieces) {}

  /// @param joined  called with the voxel for each two pieces that became one
  template <class Joined>
  void join(Joined&& joined) {
    for (std::size_t v = 0; v < voxels_.cells.size(); ++v)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (level_.merge[axis] == 1) continue;
        const std::int32_t size = level_.voxels_per_cell[axis];
        if (voxels_.cells[v][axis] % size == size / 2 - 1) join_across(v, axis, joined);
      }
  }

private:
  template <class Joined>
  void join_across(std::size_t v, std::size_t axis, Joined&& joined) {
    Index3 beyond = voxels_.cells[v];
    ++beyond[axis];
    const std::int32_t cell = cell_at_.cell_of_voxel(voxels_.cells[v]);
    const auto is_in_it = [&](const Index3& voxel) { return cell_at_.cell_of_voxel(voxel) == cell; };
    if (const std::int32_t face = voxel_at_.cell_of_voxel(beyond); face >= 0 && is_in_it(beyond)) {
      // What hangs together with that voxel does so by its own links: no need to look at the diagonals.
      if (pieces_.join(number(v), face)) joined(v);
      return;
    }
    const std::size_t u = (axis + 1) % 3, w = (axis + 2) % 3;
    for (int i = -1; i <= 1; ++i)
      for (int j = -1; j <= 1; ++j) {
        Index3 diagonal = beyond;
        diagonal[u] += i;
        diagonal[w] += j;
        const std::int32_t other = voxel_at_.cell_of_voxel(diagonal);
        if (other >= 0 && is_in_it(diagonal) && pieces_.join(number(v), other)) joined(v);
      }
  }

  static std::int32_t number(std::size_t v) { return static_cast<std::int32_t>(v); }

  const Level& level_;
  const CellLocator& cell_at_;
  const Level& voxels_;
  const CellLocator& voxel_at_;
  Partition& pieces_;
};

}  // namespace

void count_parts(Lattice& lattice) {
  const Level& voxels = lattice.levels.front();
  const CellLocator voxel_at(lattice.voxels, {1, 1, 1}, voxels.cells);
  Partition pieces(voxels.cells.size());
  std::vector<std::int64_t> joins;  // within each cell of the level, all finer levels included
  for (std::size_t l = 0; l < lattice.levels.size(); ++l) {
    Level& level = lattice.levels[l];
    const CellLocator cell_at(lattice.voxels, level.voxels_per_cell, level.cells, level.split.owners);
    std::vector<std::int64_t> finer_joins = std::move(joins);
    joins.assign(level.cells.size(), 0);
    if (l > 0) {
      const Level& finer = lattice.levels[l - 1];
      for (std::size_t c = 0; c < finer.cells.size(); ++c)
        joins[as_size(coarser_cell_of(lattice, static_cast<int>(l) - 1, static_cast<std::int32_t>(c),
                                      static_cast<int>(l)))] += finer_joins[c];
      LevelJoiner(level, cell_at, voxels, voxel_at, pieces).join([&](std::size_t v) {
        ++joins[cell_at.cell_of_voxel(voxels.cells[v])];
      });
    }
    level.parts.resize(level.cells.size());
    for (std::size_t c = 0; c < level.cells.size(); ++c) {
      const std::int64_t count = level.filled[level.element[c]] - joins[c];
      level.parts[c] = static_cast<std::uint16_t>(std::min<std::int64_t>(count, 65535));
    }
  }
}

}  // namespace hexmesh
