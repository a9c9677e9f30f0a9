// SPDX-License-Identifier: Apache-2.0
#include "splitter.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "hexmesh/core/partition.h"
#include "hexmesh/lattice/locator.h"

namespace hexmesh {
namespace {

constexpr std::size_t crumbs_in_whole = 200;  ///< see Parting::gaps
constexpr std::int32_t goes_with_any = -1;

/// Of the voxel at one of the places around a node.
Index3 beside_node(const Index3& node, int place) {
  Index3 voxel = node;
  for (int d = 0; d < 3; ++d) voxel[as_size(d)] += corner_bit(place, d) - 1;
  return voxel;
}

/// f(number) for the voxels that share a node with one, which is one of them.
template <class F>
void for_each_around(const Index3& voxel, const CellLocator& voxel_at, const F& f) {
  for (int n = 0; n < 27; ++n)
    if (const std::int32_t there =
            voxel_at.cell_of_voxel({voxel[0] + n % 3 - 1, voxel[1] + n / 3 % 3 - 1, voxel[2] + n / 9 - 1});
        there >= 0)
      f(there);
}

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
      for_each_around(level.cells[v], voxel_at, [&](std::int32_t other) {
        if (of_voxel[as_size(other)] != of_voxel[v]) ++beside[of_voxel[as_size(other)]];
      });
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

/// The voxels around a node in groups that hold together, first by faces alone.
class NodeGroups {
public:
  NodeGroups(const Index3& node, const CellLocator& voxel_at, const Faces& faces) : node_(node), groups_(8) {
    for (int place = 0; place < 8; ++place) around_[as_size(place)] = voxel_at.cell_of_voxel(beside_node(node, place));
    for (int a = 0; a < 8; ++a)
      for (int d = 0; d < 3; ++d) {
        const int b = a | 1 << d;
        if (b != a && has(a) && has(b) && faces.holds(voxel(a), voxel(b))) groups_.join(a, b);
      }
  }

  int count() {
    int out = 0;
    for (int a = 0; a < 8; ++a) out += has(a) && groups_.root(a) == a;
    return out;
  }

  bool has(int place) const { return voxel(place) >= 0; }
  std::int32_t voxel(int place) const { return around_[as_size(place)]; }
  const Index3& node() const { return node_; }

  /// f(place, place) for each two voxels of different groups. f may join them.
  template <class F>
  void for_each_apart(const F& f) {
    for (int a = 0; a < 8; ++a)
      for (int b = 0; b < a; ++b)
        if (has(a) && has(b) && groups_.root(a) != groups_.root(b)) f(a, b);
  }
  void join(int a, int b) { groups_.join(a, b); }

  /// f(place, rank of its group from 0 on), in the order of the cells, which is that of the places.
  template <class F>
  void for_each_rank(const F& f) {
    std::array<int, 8> rank = {-1, -1, -1, -1, -1, -1, -1, -1};
    int count = 0;
    for (int a = 0; a < 8; ++a) {
      if (!has(a)) continue;
      int& of_group = rank[as_size(groups_.root(a))];
      if (of_group < 0) of_group = count++;
      f(a, of_group);
    }
  }

private:
  Index3 node_;
  std::array<std::int32_t, 8> around_{};  ///< number of the voxel at each place, -1 for none
  Partition groups_;
};

/// Whether faces hold voxels around a node together by a way within `reach` voxels of it.
class WayAround {
public:
  WayAround(const Index3& node, const CellLocator& voxel_at, const Faces& faces) : same_(num_voxels) {
    std::array<std::int32_t, num_voxels> voxel{};
    for (int n = 0; n < num_voxels; ++n)
      voxel[as_size(n)] = voxel_at.cell_of_voxel(
          {node[0] - reach + n % width, node[1] - reach + n / width % width, node[2] - reach + n / (width * width)});
    int step = 1;
    for (int d = 0; d < 3; ++d, step *= width)
      for (int n = 0; n < num_voxels; ++n)
        if (n / step % width + 1 < width && voxel[as_size(n)] >= 0 && voxel[as_size(n + step)] >= 0 &&
            faces.holds(voxel[as_size(n)], voxel[as_size(n + step)]))
          same_.join(n, n + step);
  }
  bool joins(int place, int other) { return same_.root(number(place)) == same_.root(number(other)); }

private:
  static constexpr int reach = 2, width = 2 * reach, num_voxels = width * width * width;
  static int number(int place) {
    int out = 0;
    for (int d = 2; d >= 0; --d) out = out * width + reach - 1 + corner_bit(place, d);
    return out;
  }
  Partition same_;
};

/// What edges and corners hold together beside faces.
class Contacts {
public:
  Contacts(const CellLocator& voxel_at, const Faces& faces, const Parts& parts, std::vector<NodeGroups>& meeting)
      : voxel_at_(voxel_at), faces_(faces), parts_(parts) {
    for (NodeGroups& groups : meeting) {
      std::set<std::pair<std::int32_t, std::int32_t>> meet;
      groups.for_each_apart([&](int a, int b) {
        if (may_hold(groups, a, b)) meet.insert(pair_of(groups, a, b));
      });
      for (const auto& pair : meet) ++num_nodes_[pair];
    }
  }

  void hold(NodeGroups& groups) const {
    join_specks(groups);
    std::optional<WayAround> way;
    groups.for_each_apart([&](int a, int b) {
      if (!may_hold(groups, a, b)) return;
      const auto pair = pair_of(groups, a, b);
      if (pair.first != pair.second) {
        if (num_nodes_.at(pair) <= most_nodes_tied) groups.join(a, b);
        return;
      }
      if (!way) way.emplace(groups.node(), voxel_at_, faces_);
      if (way->joins(a, b)) groups.join(a, b);
    });
  }

private:
  bool is_small(const NodeGroups& groups, int place) const { return parts_.is_small[as_size(groups.voxel(place))]; }
  bool may_hold(const NodeGroups& groups, int a, int b) const {
    return !is_small(groups, a) && !is_small(groups, b) && faces_.holds(groups.voxel(a), groups.voxel(b));
  }
  std::pair<std::int32_t, std::int32_t> pair_of(const NodeGroups& groups, int a, int b) const {
    return std::minmax(parts_.of_voxel[as_size(groups.voxel(a))], parts_.of_voxel[as_size(groups.voxel(b))]);
  }

  /// Small parts with the first voxel of the part they move with, a larger one's if there is any.
  void join_specks(NodeGroups& groups) const {
    const auto part = [&](int place) { return parts_.of_voxel[as_size(groups.voxel(place))]; };
    for (int a = 0; a < 8; ++a) {
      if (!groups.has(a) || !is_small(groups, a)) continue;
      int home = -1;
      for (int b = 0; b < 8; ++b)
        if (groups.has(b) && part(b) == part(a) && (home < 0 || (is_small(groups, home) && !is_small(groups, b))))
          home = b;
      groups.join(a, home);
    }
  }

  const CellLocator& voxel_at_;
  const Faces& faces_;
  const Parts& parts_;
  std::map<std::pair<std::int32_t, std::int32_t>, int> num_nodes_;  ///< at which two parts meet
};

}  // namespace

Splitter::Splitter(const Lattice& lattice) {
  const Level& level = lattice.levels.front();
  const CellLocator voxel_at(lattice.voxels, {1, 1, 1}, level.cells);
  const Faces faces(lattice, voxel_at);
  Parts parts(faces, level, voxel_at);
  numbering_ = number_nodes(level.cells);
  std::vector<std::uint8_t> num_voxels(numbering_.nodes.size());
  for (const CellNodes& nodes : numbering_.cell_nodes)
    for (const std::int32_t node : nodes) ++num_voxels[as_size(node)];
  std::vector<NodeGroups> meeting;
  for (std::size_t n = 0; n < num_voxels.size(); ++n) {
    if (num_voxels[n] == 8 && lattice.parting.sliding.empty()) continue;  // all around it hang together
    if (NodeGroups groups(numbering_.nodes[n], voxel_at, faces); groups.count() > 1)
      meeting.push_back(std::move(groups));
  }
  const Contacts contacts(voxel_at, faces, parts, meeting);
  std::vector<std::pair<std::int64_t, std::int32_t>> copies;
  for (NodeGroups& groups : meeting) {
    contacts.hold(groups);
    groups.for_each_rank([&](int place, int rank) {
      if (rank > 0) copies.emplace_back(8 * std::int64_t{groups.voxel(place)} + (7 - place), rank);
    });
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
  if (lattice.parting.gaps) find_crumbs(level.cells, voxel_at);
}

/// Small bodies that touch nothing.
void Splitter::find_crumbs(const std::vector<Index3>& voxels, const CellLocator& voxel_at) {
  Partition bodies(numbering_.nodes.size());
  for (const CellNodes& nodes : numbering_.cell_nodes)
    for (const std::int32_t node : nodes) bodies.join(nodes[0], node);
  const auto body = [&](std::int32_t voxel) { return bodies.root(numbering_.cell_nodes[voxel][0]); };
  std::map<std::int32_t, std::size_t> size;
  for (std::size_t v = 0; v < voxels.size(); ++v) ++size[body(static_cast<std::int32_t>(v))];
  std::erase_if(size, [&](const auto& entry) { return crumbs_in_whole * entry.second > voxels.size(); });
  std::set<std::int32_t> touching;
  is_crumb_.resize(voxels.size());
  const auto for_each_of_small_bodies = [&](const auto& f) {
    for (std::size_t v = 0; v < voxels.size(); ++v)
      if (const std::int32_t of = body(static_cast<std::int32_t>(v)); size.contains(of)) f(v, of);
  };
  for_each_of_small_bodies([&](std::size_t v, std::int32_t of) {
    for_each_around(voxels[v], voxel_at, [&](std::int32_t other) {
      if (body(other) != of) touching.insert(of);
    });
  });
  for_each_of_small_bodies([&](std::size_t v, std::int32_t of) {
    if (touching.contains(of)) return;
    is_crumb_[v] = is_small_[v] = true;
    part_[v] = goes_with_any;
  });
}

Merge Splitter::merge(const std::vector<Index3>& cells, const Index3& factor) {
  Merge merge = merge_linked_cells(cells, numbering_.cell_nodes, factor, is_crumb_);
  numbering_ = number_parent_nodes(merge, numbering_.cell_nodes, numbering_.nodes.size(), is_small_, part_);
  std::vector<std::int32_t> parent(cells.size());
  std::vector<bool> is_small(merge.parents.size(), true), is_crumb(is_crumb_.empty() ? 0 : merge.parents.size(), true);
  std::vector<std::int32_t> part(merge.parents.size(), goes_with_any);
  for (std::size_t p = 0; p < merge.parents.size(); ++p)
    for (const std::int32_t child : merge.children[p])
      if (child >= 0) {
        parent[as_size(child)] = static_cast<std::int32_t>(p);
        is_small[p] = is_small[p] && is_small_[as_size(child)];
        if (!is_crumb.empty()) is_crumb[p] = is_crumb[p] && is_crumb_[as_size(child)];
        if (part_[as_size(child)] != goes_with_any) part[p] = part_[as_size(child)];
      }
  is_small_ = std::move(is_small);
  is_crumb_ = std::move(is_crumb);
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
