// SPDX-License-Identifier: Apache-2.0
#include "splitter.h"

#include <algorithm>
#include <map>

#include "hexmesh/core/partition.h"
#include "hexmesh/lattice/locator.h"

namespace hexmesh {
namespace {

/// Which faces between voxels hold.
class Faces {
public:
  Faces(const Lattice& lattice, const CellLocator& voxel_at)
      : cells_(lattice.levels.front()), voxel_at_(voxel_at), parting_(lattice.parting) {}

  /// The voxel beyond the upper face of another along an axis if that face holds, else -1.
  std::int32_t above(std::int32_t cell, std::size_t axis) const {
    Index3 beyond = cells_.cells[cell];
    ++beyond[axis];
    const std::int32_t other = voxel_at_.cell_of_voxel(beyond);
    return other >= 0 && holds(cell, other) ? other : -1;
  }
  bool holds(std::int32_t a, std::int32_t b) const { return !parting_.slide(cells_.segment[a], cells_.segment[b]); }

private:
  const Level& cells_;
  const CellLocator& voxel_at_;
  const Parting& parting_;
};

/// Parts of the body that faces hold together, and which of them move with another.
struct Parts {
  std::vector<std::int32_t> of_voxel;  ///< the part that a voxel moves with
  std::vector<bool> is_small;          ///< of each voxel, whether its part is no body of its own

  Parts(const Faces& faces, const Level& level, const CellLocator& voxel_at)
      : of_voxel(level.cells.size()), is_small(of_voxel.size()) {
    const std::size_t count = of_voxel.size();
    Partition parts(count);
    for (std::size_t v = 0; v < count; ++v)
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (const std::int32_t other = faces.above(static_cast<std::int32_t>(v), axis); other >= 0)
          parts.join(static_cast<std::int32_t>(v), other);
    std::vector<std::int32_t> size(count);
    for (std::size_t v = 0; v < count; ++v) {
      of_voxel[v] = parts.root(static_cast<std::int32_t>(v));
      ++size[as_size(of_voxel[v])];
    }
    for (std::size_t v = 0; v < count; ++v) is_small[v] = size[as_size(of_voxel[v])] <= most_voxels_tied;
    move_small_ones(level, voxel_at);
  }

private:
  /// Each with one part alone, or it would tie two together: the one most of whose voxels are around its own, of larger
  /// ones if there is any. Those that have none but small ones around them move with these.
  void move_small_ones(const Level& level, const CellLocator& voxel_at) {
    std::map<std::int32_t, std::map<std::int32_t, int>> around;  // of small parts, those beside them, how often
    for (std::size_t v = 0; v < of_voxel.size(); ++v) {
      if (!is_small[v]) continue;
      auto& beside = around[of_voxel[v]];
      for (int n = 0; n < 27; ++n) {
        const Index3& at = level.cells[v];
        const std::int32_t other =
            voxel_at.cell_of_voxel({at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1});
        if (other >= 0 && of_voxel[as_size(other)] != of_voxel[v]) ++beside[of_voxel[as_size(other)]];
      }
    }
    std::map<std::int32_t, std::int32_t> moves_with;
    const auto rest = [&](std::int32_t part) {
      const auto found = moves_with.find(part);
      return found != moves_with.end() ? found->second : around.count(part) == 0 ? part : -1;
    };
    for (bool is_any_new = true; is_any_new;) {
      is_any_new = false;
      for (const auto& [part, beside] : around) {
        if (moves_with.count(part) > 0) continue;
        std::pair<int, std::int32_t> most = {0, -1};
        for (const auto& [other, times] : beside)
          if (rest(other) >= 0 && times > most.first) most = {times, rest(other)};
        if (most.second < 0) continue;
        moves_with[part] = most.second;
        is_any_new = true;
      }
    }
    Partition alone(of_voxel.size());  // among small ones only
    for (const auto& [part, beside] : around)
      for (const auto& [other, times] : beside)
        if (rest(part) < 0 && rest(other) < 0) alone.join(part, other);
    for (std::int32_t& part : of_voxel) part = rest(part) >= 0 ? rest(part) : alone.root(part);
  }
};

/// The voxels around a node in groups that faces hold together, small parts with the first of the part they move with.
class NodeGroups {
public:
  /// @param around  of the voxel at each of the eight places around the node its number, -1 for none
  NodeGroups(const std::array<std::int32_t, 8>& around, const Faces& faces, const Parts& parts) : groups_(8) {
    for (int a = 0; a < 8; ++a)
      for (int d = 0; d < 3; ++d) {
        const int b = a | 1 << d;
        if (b != a && around[as_size(a)] >= 0 && around[as_size(b)] >= 0 &&
            faces.holds(around[as_size(a)], around[as_size(b)]))
          groups_.join(a, b);
      }
    const auto is_small = [&](int a) { return bool{parts.is_small[as_size(around[as_size(a)])]}; };
    for (int a = 0; a < 8; ++a) {
      if (around[as_size(a)] < 0 || !is_small(a)) continue;
      int home = -1;  // the first voxel of its part, a larger one's if there is any
      for (int b = 0; b < 8; ++b)
        if (around[as_size(b)] >= 0 &&
            parts.of_voxel[as_size(around[as_size(b)])] == parts.of_voxel[as_size(around[as_size(a)])] &&
            (home < 0 || (is_small(home) && !is_small(b))))
          home = b;
      groups_.join(a, home);
    }
    // In the order of the cells, which is that of the places.
    for (int a = 0; a < 8; ++a) {
      if (around[as_size(a)] < 0) continue;
      const int root = groups_.root(a);
      if (rank_[as_size(root)] < 0) rank_[as_size(root)] = count_++;
    }
  }
  int count() const { return count_; }
  int rank(int place) { return rank_[as_size(groups_.root(place))]; }

private:
  Partition groups_;
  std::array<int, 8> rank_ = {-1, -1, -1, -1, -1, -1, -1, -1};
  int count_ = 0;
};

}  // namespace

Splitter::Splitter(const Lattice& lattice) {
  const Level& level = lattice.levels.front();
  const CellLocator voxel_at(lattice.voxels, {1, 1, 1}, level.cells);
  const Faces faces(lattice, voxel_at);
  Parts parts(faces, level, voxel_at);
  numbering_ = number_nodes(level.cells);
  std::vector<std::pair<std::int64_t, std::int32_t>> copies;
  for (const Index3& node : numbering_.nodes) {
    std::array<std::int32_t, 8> around{};
    for (int place = 0; place < 8; ++place) {
      Index3 voxel = node;
      for (int d = 0; d < 3; ++d) voxel[as_size(d)] += corner_bit(place, d) - 1;
      around[as_size(place)] = voxel_at.cell_of_voxel(voxel);
    }
    NodeGroups groups(around, faces, parts);
    if (groups.count() == 1) continue;
    for (int place = 0; place < 8; ++place)
      if (around[as_size(place)] >= 0 && groups.rank(place) > 0)
        copies.emplace_back(8 * std::int64_t{around[as_size(place)]} + (7 - place), groups.rank(place));
  }
  std::sort(copies.begin(), copies.end());
  SplitCells split;
  for (const auto& [corner, copy] : copies) {
    split.corners.push_back(corner);
    split.copies.push_back(copy);
  }
  numbering_ = number_nodes(level.cells, split);
  for (std::size_t v = 0; v < level.cells.size(); ++v) {
    cell_of_.push_back(static_cast<std::int32_t>(v));
    voxel_offset_.push_back(static_cast<std::int64_t>(lattice.voxels.offset(level.cells[v])));
  }
  is_small_ = std::move(parts.is_small);
  part_ = std::move(parts.of_voxel);
}

Merge Splitter::merge(const std::vector<Index3>& cells, const Index3& factor) {
  Merge merge = merge_linked_cells(cells, numbering_.cell_nodes, factor);
  numbering_ = number_parent_nodes(merge, numbering_.cell_nodes, numbering_.nodes.size(), is_small_, part_);
  std::vector<std::int32_t> parent(cells.size());
  std::vector<bool> is_small(merge.parents.size(), true);
  std::vector<std::int32_t> part(merge.parents.size());
  for (std::size_t p = 0; p < merge.parents.size(); ++p)
    for (const std::int32_t child : merge.children[p])
      if (child >= 0) {
        parent[as_size(child)] = static_cast<std::int32_t>(p);
        is_small[p] = is_small[p] && is_small_[as_size(child)];
        part[p] = part_[as_size(child)];
      }
  is_small_ = std::move(is_small);
  part_ = std::move(part);
  for (std::int32_t& cell : cell_of_) cell = parent[as_size(cell)];
  return merge;
}

SplitCells Splitter::split(const std::vector<Index3>& cells) const {
  SplitCells out;
  std::vector<std::int32_t> first(numbering_.nodes.size());  // node at the same index
  for (std::size_t n = 1; n < first.size(); ++n)
    first[n] = numbering_.nodes[n] == numbering_.nodes[n - 1] ? first[n - 1] : static_cast<std::int32_t>(n);
  for (std::size_t c = 0; c < cells.size(); ++c)
    for (std::size_t a = 0; a < 8; ++a)
      if (const std::int32_t node = numbering_.cell_nodes[c][a]; node != first[as_size(node)]) {
        out.corners.push_back(static_cast<std::int64_t>(8 * c + a));
        out.copies.push_back(node - first[as_size(node)]);
      }
  for (std::size_t v = 0; v < cell_of_.size(); ++v)
    if (shares_index(cells, as_size(cell_of_[v]))) {
      out.owners.voxels.push_back(voxel_offset_[v]);
      out.owners.cells.push_back(cell_of_[v]);
    }
  return out;
}

}  // namespace hexmesh
