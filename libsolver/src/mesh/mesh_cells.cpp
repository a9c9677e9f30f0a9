// SPDX-License-Identifier: Apache-2.0
#include "mesh/mesh_cells.h"

#include <algorithm>
#include <unordered_set>

#include "hexmesh/core/error.h"
#include "hexmesh/lattice/element_tree.h"

namespace hexsolver {
namespace {

using hexmesh::Lattice;
using hexmesh::Level;

/// The cells of a lattice from some level on, down to where they are divided.
class Tree {
public:
  Tree(const Lattice& lattice, int finest, int coarsest)
      : lattice_(lattice), finest_(finest), coarsest_(coarsest), divided_(lattice.levels.size()) {
    for (int l = finest; l <= coarsest; ++l) divided_[hexmesh::as_size(l)].resize(lattice.level(l).cells.size());
  }

  /// Those of a level whose parents are divided, ascending; of the coarsest all.
  std::vector<std::int32_t> cells(int level) const {
    std::vector<std::int32_t> out;
    if (level == coarsest_) {
      for (std::size_t c = 0; c < lattice_.level(level).cells.size(); ++c) out.push_back(static_cast<std::int32_t>(c));
      return out;
    }
    const Level &parents = lattice_.level(level + 1), &of = lattice_.level(level);
    for (std::size_t p = 0; p < parents.cells.size(); ++p) {
      const bool is_at_next = p > 0 && parents.cells[p] == parents.cells[p - 1];  // whose children are these too
      if (is_at_next || !is_divided(level + 1, p)) continue;
      const Index3 first_child = hexmesh::first_in(parents.cells[p], parents.merge);
      for (int slot = 0; slot < 8; ++slot) {
        const Index3 child = hexmesh::corner_of(first_child, slot);
        if (hexmesh::coarser_index(child, parents.merge) != parents.cells[p]) continue;
        const auto [first, end] = hexmesh::cells_at(of.cells, child);
        for (std::int32_t c = first; c < end; ++c) out.push_back(c);
      }
    }
    std::sort(out.begin(), out.end());
    return out;
  }

  bool is_divided(int level, std::size_t cell) const { return divided_[hexmesh::as_size(level)][cell]; }
  /// All cells at an index, if there are any.
  void divide(int level, const Index3& index) {
    const auto [first, end] = hexmesh::cells_at(lattice_.level(level).cells, index);
    std::fill_n(divided_[hexmesh::as_size(level)].begin() + first, end - first, true);
  }

  /// So that no cell touches one of more than the next level: what holds it or a neighbour two levels up is divided.
  void balance() {
    for (int l = finest_; l + 2 <= coarsest_; ++l) {
      const Level& level = lattice_.level(l);
      const Index3 &merge = lattice_.level(l + 1).merge, &merge_again = lattice_.level(l + 2).merge;
      for (const std::int32_t c : cells(l))
        for (int around = 0; around < 27; ++around) {
          Index3 index = level.cells[hexmesh::as_size(c)];
          for (std::size_t d = 0, rest = hexmesh::as_size(around); d < 3; ++d, rest /= 3)
            index[d] += static_cast<std::int32_t>(rest % 3) - 1;
          if (*std::min_element(index.begin(), index.end()) < 0) continue;
          divide(l + 2, hexmesh::coarser_index(hexmesh::coarser_index(index, merge), merge_again));
        }
    }
  }

private:
  const Lattice& lattice_;
  int finest_, coarsest_;
  std::vector<std::vector<bool>> divided_;  ///< by level and cell
};

/// The nodes of graded cells of a lattice some of whose cells are split.
class LeafNodes final : public SplitNodes {
public:
  explicit LeafNodes(const MeshCells& cells) : cells_(cells) {}

  std::int32_t copy(std::size_t cell, int corner) const override {
    const auto [level, number] = cells_.place(cell);
    return cells_.lattice().level(level).split.copy(number, corner);
  }

  bool holds(std::size_t cell, const Index3& place, std::int32_t copy) const override {
    const Lattice& lattice = cells_.lattice();
    const auto [number, leaf] = cells_.place(cell);
    const Level &level = lattice.level(number), &below = lattice.level(number - 1);
    const Index3 node = hexmesh::coarser_index(hexmesh::first_in(place, cells_.unit()), below.voxels_per_cell);
    for (int corner = 0; corner < 8; ++corner) {
      Index3 child = node;
      for (int d = 0; d < 3; ++d) child[static_cast<std::size_t>(d)] -= hexmesh::corner_bit(corner, d);
      if (*std::min_element(child.begin(), child.end()) < 0 ||
          hexmesh::coarser_index(child, level.merge) != level.cells[hexmesh::as_size(leaf)])
        continue;
      const auto [first, end] = hexmesh::cells_at(below.cells, child);
      for (std::int32_t c = first; c < end; ++c)
        if (below.split.copy(c, corner) == copy && hexmesh::coarser_cell_of(lattice, number - 1, c, number) == leaf)
          return true;
    }
    return false;
  }

private:
  const MeshCells& cells_;
};

}  // namespace

MeshCells::MeshCells(const Lattice& lattice, int level) : lattice_(&lattice), level_(level) { add_level(level, {}); }

MeshCells::MeshCells(const Lattice& lattice, int finest, int coarsest, const IsTooLarge& is_too_large)
    : lattice_(&lattice), level_(finest) {
  Tree tree(lattice, finest, coarsest);
  for (int l = coarsest; l > finest; --l)
    for (const std::int32_t c : tree.cells(l))
      if (const Index3& cell = lattice.level(l).cells[hexmesh::as_size(c)]; is_too_large(l, cell)) tree.divide(l, cell);
  tree.balance();
  for (int l = finest; l <= coarsest; ++l) {
    std::vector<std::int32_t> leaves = tree.cells(l);
    std::erase_if(leaves, [&](std::int32_t c) { return l > finest && tree.is_divided(l, hexmesh::as_size(c)); });
    if (!leaves.empty()) add_level(l, std::move(leaves));
  }
}

MeshCells MeshCells::coarser() const {
  MeshCells out;
  out.lattice_ = lattice_;
  const OfLevel& finest = levels_.front();
  out.level_ = finest.level + 1;
  std::vector<std::int32_t> merged;
  for (const std::int32_t c : finest.cells)
    merged.push_back(hexmesh::coarser_cell_of(*lattice_, finest.level, c, out.level_));
  const bool has_others = levels_[1].level == out.level_;
  if (has_others) merged.insert(merged.end(), levels_[1].cells.begin(), levels_[1].cells.end());
  std::sort(merged.begin(), merged.end());
  merged.erase(std::unique(merged.begin(), merged.end()), merged.end());
  out.add_level(out.level_, std::move(merged));
  for (std::size_t l = has_others ? 2 : 1; l < levels_.size(); ++l) out.add_level(levels_[l].level, levels_[l].cells);
  return out;
}

MeshCells MeshCells::divided(const std::vector<bool>& which) const {
  std::vector<std::unordered_set<std::uint64_t>> are_divided(lattice_->levels.size());
  int finest = levels_.front().level;
  const int coarsest = levels_.back().level;
  for (std::size_t c = 0; c < size_; ++c) {
    auto [level, cell] = place(c);
    Index3 index = lattice_->level(level).cells[hexmesh::as_size(cell)];
    if (which[c] && level > 0) {
      are_divided[hexmesh::as_size(level)].insert(hexmesh::sort_key(index));
      finest = std::min(finest, level - 1);
    }
    while (level < coarsest) {
      index = hexmesh::coarser_index(index, lattice_->level(++level).merge);
      if (!are_divided[hexmesh::as_size(level)].insert(hexmesh::sort_key(index)).second) break;
    }
  }
  return {*lattice_, finest, coarsest, [&](int level, const Index3& cell) {
            return are_divided[hexmesh::as_size(level)].contains(hexmesh::sort_key(cell));
          }};
}

std::int32_t MeshCells::number(const OfLevel& of, std::int32_t cell) {
  std::int32_t place = cell;
  if (!of.cells.empty()) {
    const auto found = std::lower_bound(of.cells.begin(), of.cells.end(), cell);
    if (found == of.cells.end() || *found != cell) return -1;
    place = static_cast<std::int32_t>(found - of.cells.begin());
  }
  return static_cast<std::int32_t>(of.first) + place;
}

std::int32_t MeshCells::holder(int level, std::int32_t cell) const {
  for (const OfLevel& of : levels_) {
    if (of.level < level) continue;
    const std::int32_t there = of.level == level ? cell : hexmesh::coarser_cell_of(*lattice_, level, cell, of.level);
    if (const std::int32_t n = there < 0 ? -1 : number(of, there); n >= 0) return n;
  }
  return -1;
}

std::int32_t MeshCells::cell_of_voxel(const Index3& voxel) const {
  for (const OfLevel& of : levels_) {
    const Level& level = lattice_->level(of.level);
    const auto [first, end] = hexmesh::cells_at(level.cells, hexmesh::coarser_index(voxel, level.voxels_per_cell));
    if (first == end) continue;
    const std::int32_t cell =
        end - first == 1 ? first : level.split.owners.of(static_cast<std::int64_t>(lattice_->voxels.offset(voxel)));
    if (const std::int32_t n = cell < 0 ? -1 : number(of, cell); n >= 0) return n;
  }
  return -1;
}

void MeshCells::add_level(int level, std::vector<std::int32_t> cells) {
  const Level& of = lattice_->level(level);
  if (cells.size() == of.cells.size()) cells.clear();  // all
  OfLevel added{level, size_, std::move(cells), {}, num_elements_};
  for (const std::int32_t c : added.cells) added.element.push_back(of.element[hexmesh::as_size(c)]);
  std::sort(added.element.begin(), added.element.end());
  added.element.erase(std::unique(added.element.begin(), added.element.end()), added.element.end());
  size_ += added.cells.empty() ? of.cells.size() : added.cells.size();
  num_elements_ += added.element.empty() ? of.filled.size() : added.element.size();
  levels_.push_back(std::move(added));
}

Mesh MeshCells::make_mesh() const {
  if (const int only = levels_.front().level; levels_.size() == 1)
    return {lattice_->level(only).cells, hexmesh::nodes_of(lattice_->level(only)), lattice_->cell_edges(only),
            lattice_->corner()};
  std::vector<Index3> cells;
  std::vector<CellsOfSize> sizes;
  for (const OfLevel& of : levels_) {
    const Level& level = lattice_->level(of.level);
    sizes.push_back({of.first, hexmesh::coarser_index(level.voxels_per_cell, unit()), lattice_->cell_edges(of.level)});
    for (const std::int32_t c : of.cells) cells.push_back(level.cells[hexmesh::as_size(c)]);
  }
  const LeafNodes split(*this);
  return {std::move(cells), std::move(sizes), lattice_->corner(), lattice_->parting.any() ? &split : nullptr};
}

std::vector<std::int32_t> MeshCells::elements() const {
  if (levels_.size() == 1) return lattice_->level(levels_.front().level).element;
  std::vector<std::int32_t> out;
  for (const OfLevel& of : levels_)
    for (const std::int32_t c : of.cells) {
      const std::int32_t element = lattice_->level(of.level).element[hexmesh::as_size(c)];
      const auto place = std::lower_bound(of.element.begin(), of.element.end(), element) - of.element.begin();
      out.push_back(static_cast<std::int32_t>(of.first_element + static_cast<std::size_t>(place)));
    }
  return out;
}

std::vector<std::int32_t> holders(const MeshCells& of, const MeshCells& in) {
  const Lattice& lattice = of.lattice();
  // Neighbours have the same one, or the next.
  const auto find_near = [&](std::int32_t last, int level, std::int32_t cell) -> std::int32_t {
    const int above = in.place(hexmesh::as_size(last)).level;
    if (above < level) return -1;
    const Level &fine = lattice.level(level), &coarse = lattice.level(above);
    const Index3 low = hexmesh::first_in(fine.cells[hexmesh::as_size(cell)], fine.voxels_per_cell),
                 index = hexmesh::coarser_index(low, coarse.voxels_per_cell);
    for (std::int32_t near = last; near <= last + 1 && hexmesh::as_size(near) < in.size(); ++near) {
      const auto [its_level, there] = in.place(hexmesh::as_size(near));
      if (its_level == above && coarse.cells[hexmesh::as_size(there)] == index)
        return hexmesh::shares_index(coarse.cells, hexmesh::as_size(there)) ? -1 : near;
    }
    return -1;
  };
  std::vector<std::int32_t> out;
  out.reserve(of.size());
  for (std::size_t c = 0; c < of.size(); ++c) {
    const auto [level, cell] = of.place(c);
    const std::int32_t near = c > 0 && out.back() >= 0 ? find_near(out.back(), level, cell) : -1;
    out.push_back(near >= 0 ? near : in.holder(level, cell));
  }
  return out;
}

hexmesh::Merge merge_into(const MeshCells& fine, const MeshCells& coarse) {
  const Lattice& lattice = fine.lattice();
  hexmesh::Merge merge{lattice.level(fine.levels().front().level + 1).merge, {}, {}, {}};
  for (std::size_t c = 0; c < coarse.size(); ++c) {
    const auto [level, cell] = coarse.place(c);
    merge.parents.push_back(lattice.level(level).cells[hexmesh::as_size(cell)]);
  }
  merge.children.resize(coarse.size(), {-1, -1, -1, -1, -1, -1, -1, -1});
  merge.is_kept.resize(coarse.size());
  const std::vector<std::int32_t> parents = holders(fine, coarse);
  for (std::size_t c = 0; c < parents.size(); ++c) {
    const std::size_t parent = hexmesh::as_size(parents[c]);
    const auto [level, cell] = fine.place(c);
    merge.is_kept[parent] = coarse.place(parent).level == level;
    const Index3& index = lattice.level(level).cells[hexmesh::as_size(cell)];
    const int slot = merge.is_kept[parent] ? 0 : hexmesh::slot_in_parent(index, merge.factor);
    merge.children[parent][hexmesh::as_size(slot)] = static_cast<std::int32_t>(c);
  }
  return merge;
}

std::vector<hexmesh::Element> form_elements(const Lattice& lattice, const MeshCells::OfLevel& of) {
  if (of.element.empty()) return hexmesh::form_elements(lattice, of.level);
  hexmesh::ElementTree tree(lattice);
  std::vector<hexmesh::Element> out;
  for (const std::int32_t e : of.element) out.push_back(tree.form(of.level, e));
  return out;
}

}  // namespace hexsolver
