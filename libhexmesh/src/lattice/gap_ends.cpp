// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/gap_ends.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "hexmesh/core/partition.h"
#include "hexmesh/lattice/merge.h"
#include "hexmesh/lattice/nodes.h"

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

/// Calls f(place, parent, another parent) for places of two nodes of a finer level that a coarser one moves alike, with
/// the cells of the latter that do. A place may come again.
template <class F>
void for_each_closed(const Lattice& lattice, int finer, int coarser, F&& f) {
  const Level &above = lattice.level(coarser), &below = lattice.level(finer);
  const std::vector<std::int64_t>& corners = below.split.corners;
  if (corners.empty()) return;
  const std::vector<std::int32_t> parents = coarser_cells_of(lattice, finer, coarser);
  const Index3 ratio = coarser_index(above.voxels_per_cell, below.voxels_per_cell);
  for (std::size_t n = 0; n < corners.size(); ++n) {
    const auto cell = static_cast<std::size_t>(corners[n] / 8);
    const Index3 node = corner_of(below.cells[cell], static_cast<int>(corners[n] % 8));
    const std::int32_t parent = parents[cell];
    Vec3 local;
    for (std::size_t d = 0; d < 3; ++d)
      local[static_cast<Eigen::Index>(d)] =
          static_cast<double>(node[d] - ratio[d] * above.cells[as_size(parent)][d]) / ratio[d];
    const NodeWeights weights = shape_functions(local);
    for_each_corner_at(below, node, [&](std::int32_t c, int corner) {
      const std::int32_t other = parents[as_size(c)];
      if (below.split.copy(c, corner) != below.split.copies[n] && move_alike(above, parent, other, weights))
        f(node, parent, other);
    });
  }
}

/// Places of two nodes on level 1, and the gaps that they are of: places that corners of one cell can be are of one.
class Gaps {
public:
  explicit Gaps(const Level& level) {
    for (const std::int64_t corner : level.split.corners)
      places_.push_back(sort_key(corner_of(level.cells[as_size(corner / 8)], static_cast<int>(corner % 8))));
    std::sort(places_.begin(), places_.end());
    places_.erase(std::unique(places_.begin(), places_.end()), places_.end());
    Partition parts(places_.size());
    for (const std::int64_t corner : level.split.corners) {
      const Index3& cell = level.cells[as_size(corner / 8)];
      const std::size_t own = number(corner_of(cell, static_cast<int>(corner % 8)));
      for (int a = 0; a < 8; ++a)
        if (const std::size_t n = number(corner_of(cell, a)); n < places_.size())
          parts.join(static_cast<std::int32_t>(own), static_cast<std::int32_t>(n));
    }
    for (std::size_t n = 0; n < places_.size(); ++n) gap_of_.push_back(parts.root(static_cast<std::int32_t>(n)));
  }

  std::size_t size() const { return places_.size(); }
  /// Which places a level closes.
  std::vector<bool> closed_by(const Lattice& lattice, int level) const {
    std::vector<bool> out(places_.size());
    for_each_closed(lattice, 1, level,
                    [&](const Index3& place, std::int32_t, std::int32_t) { out[number(place)] = true; });
    return out;
  }
  std::int32_t gap_of(std::size_t place) const { return gap_of_[place]; }

private:
  std::size_t number(const Index3& place) const {
    const auto found = std::lower_bound(places_.begin(), places_.end(), sort_key(place));
    return found != places_.end() && *found == sort_key(place) ? as_size(found - places_.begin()) : places_.size();
  }

  std::vector<std::uint64_t> places_;
  std::vector<std::int32_t> gap_of_;
};

}  // namespace

std::vector<bool> cells_where_gaps_end(const Lattice& lattice, int level) {
  std::vector<bool> out(lattice.level(level).cells.size());
  for_each_closed(lattice, level - 1, level, [&](const Index3&, std::int32_t parent, std::int32_t other) {
    out[as_size(parent)] = out[as_size(other)] = true;
  });
  return out;
}

void measure_open_gaps(Lattice& lattice) {
  for (Level& level : lattice.levels) level.gaps = {};
  if (lattice.num_levels() < 3 || lattice.level(1).split.corners.empty()) return;
  const Gaps gaps(lattice.level(1));
  const double volume = static_cast<double>(lattice.level(0).cells.size()) * lattice.voxels.voxel_volume();
  const double area = std::pow(lattice.cell_size(1).prod() / volume, 2.0 / 3);  // of a place
  std::vector<bool> closed_finer(gaps.size());
  for (int l = 2; l < lattice.num_levels(); ++l) {
    std::vector<bool> closed = gaps.closed_by(lattice, l), is_open(gaps.size());
    for (std::size_t n = 0; n < gaps.size(); ++n)
      if (!closed[n]) is_open[as_size(gaps.gap_of(n))] = true;
    OpenGaps& of_level = lattice.level(l).gaps;
    for (std::size_t n = 0; n < gaps.size(); ++n) {
      if (!is_open[as_size(gaps.gap_of(n))]) continue;
      (closed[n] ? of_level.closed : of_level.open) += area;
      if (closed_finer[n]) of_level.closed_finer += area;
    }
    closed_finer.swap(closed);
  }
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
