// SPDX-License-Identifier: Apache-2.0
#include "splitter.h"

#include <algorithm>

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

std::vector<bool> voxels_of_small_parts(const Faces& faces, std::size_t count) {
  Partition parts(count);
  for (std::size_t v = 0; v < count; ++v)
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (const std::int32_t other = faces.above(static_cast<std::int32_t>(v), axis); other >= 0)
        parts.join(static_cast<std::int32_t>(v), other);
  std::vector<std::int32_t> size(count);
  for (std::size_t v = 0; v < count; ++v) ++size[as_size(parts.root(static_cast<std::int32_t>(v)))];
  std::vector<bool> out(count);
  for (std::size_t v = 0; v < count; ++v)
    out[v] = size[as_size(parts.root(static_cast<std::int32_t>(v)))] <= most_voxels_tied;
  return out;
}

/// The voxels around a node in groups that faces hold together, small parts with the first of the others.
class NodeGroups {
public:
  /// @param around  of the voxel at each of the eight places around the node its number, -1 for none
  NodeGroups(const std::array<std::int32_t, 8>& around, const Faces& faces, const std::vector<bool>& is_small)
      : groups_(8) {
    for (int a = 0; a < 8; ++a)
      for (int d = 0; d < 3; ++d) {
        const int b = a | 1 << d;
        if (b != a && around[as_size(a)] >= 0 && around[as_size(b)] >= 0 &&
            faces.holds(around[as_size(a)], around[as_size(b)]))
          groups_.join(a, b);
      }
    int home = -1;
    for (int a = 0; a < 8 && home < 0; ++a)
      if (around[as_size(a)] >= 0 && !is_small[as_size(around[as_size(a)])]) home = a;
    for (int a = 0; a < 8; ++a) {
      if (around[as_size(a)] < 0 || !is_small[as_size(around[as_size(a)])]) continue;
      if (home < 0) home = a;
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
  is_small_ = voxels_of_small_parts(faces, level.cells.size());
  numbering_ = number_nodes(level.cells);
  std::vector<std::pair<std::int64_t, std::int32_t>> copies;
  for (const Index3& node : numbering_.nodes) {
    std::array<std::int32_t, 8> around{};
    for (int place = 0; place < 8; ++place) {
      Index3 voxel = node;
      for (int d = 0; d < 3; ++d) voxel[as_size(d)] += corner_bit(place, d) - 1;
      around[as_size(place)] = voxel_at.cell_of_voxel(voxel);
    }
    NodeGroups groups(around, faces, is_small_);
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
}

Merge Splitter::merge(const std::vector<Index3>& cells, const Index3& factor) {
  Merge merge = merge_linked_cells(cells, numbering_.cell_nodes, factor);
  numbering_ = number_parent_nodes(merge, numbering_.cell_nodes, numbering_.nodes.size(), is_small_);
  std::vector<std::int32_t> parent(cells.size());
  std::vector<bool> is_small(merge.parents.size(), true);
  for (std::size_t p = 0; p < merge.parents.size(); ++p)
    for (const std::int32_t child : merge.children[p])
      if (child >= 0) {
        parent[as_size(child)] = static_cast<std::int32_t>(p);
        is_small[p] = is_small[p] && is_small_[as_size(child)];
      }
  is_small_ = std::move(is_small);
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
