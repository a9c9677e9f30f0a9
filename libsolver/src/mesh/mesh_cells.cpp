// SPDX-License-Identifier: Apache-2.0
#include "mesh/mesh_cells.h"

#include <algorithm>

#include "hexmesh/core/error.h"
#include "hexmesh/lattice/element_tree.h"

namespace hexsolver {
namespace {

using hexmesh::Lattice;
using hexmesh::Level;

/// Number of a cell of a level; -1 if there is none.
std::int32_t find_cell(const Level& level, const Index3& index) {
  const auto found = std::lower_bound(level.cells.begin(), level.cells.end(), index, hexmesh::i_fastest);
  return found != level.cells.end() && *found == index ? static_cast<std::int32_t>(found - level.cells.begin()) : -1;
}

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
      if (!is_divided(level + 1, p)) continue;
      for (int slot = 0; slot < 8; ++slot) {
        Index3 child = parents.cells[p];
        bool is_there = true;
        for (std::size_t d = 0; d < 3; ++d) {
          const int upper = hexmesh::corner_bit(slot, static_cast<int>(d));
          is_there = is_there && upper < parents.merge[d];
          child[d] = child[d] * parents.merge[d] + upper;
        }
        if (const std::int32_t number = is_there ? find_cell(of, child) : -1; number >= 0) out.push_back(number);
      }
    }
    std::sort(out.begin(), out.end());
    return out;
  }

  bool is_divided(int level, std::size_t cell) const { return divided_[hexmesh::as_size(level)][cell]; }
  void divide(int level, std::int32_t cell) { divided_[hexmesh::as_size(level)][hexmesh::as_size(cell)] = true; }

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
          const Index3 above = hexmesh::coarser_index(hexmesh::coarser_index(index, merge), merge_again);
          if (const std::int32_t number = find_cell(lattice_.level(l + 2), above); number >= 0) divide(l + 2, number);
        }
    }
  }

private:
  const Lattice& lattice_;
  int finest_, coarsest_;
  std::vector<std::vector<bool>> divided_;  ///< by level and cell
};

}  // namespace

MeshCells::MeshCells(const Lattice& lattice, int level) : lattice_(&lattice), level_(level) { add_level(level, {}); }

MeshCells::MeshCells(const Lattice& lattice, int finest, int coarsest, const IsTooLarge& is_too_large)
    : lattice_(&lattice), level_(finest) {
  if (lattice.parting.any())
    throw hexmesh::Error(hexmesh::ErrorKind::input,
                         "solve.grading is asked for on a lattice whose cells are split (--gaps, --slide), expected "
                         "cells of one size there");
  Tree tree(lattice, finest, coarsest);
  for (int l = coarsest; l > finest; --l)
    for (const std::int32_t c : tree.cells(l))
      if (is_too_large(l, lattice.level(l).cells[hexmesh::as_size(c)])) tree.divide(l, c);
  tree.balance();
  for (int l = finest; l <= coarsest; ++l) {
    std::vector<std::int32_t> leaves = tree.cells(l);
    std::erase_if(leaves, [&](std::int32_t c) { return l > finest && tree.is_divided(l, hexmesh::as_size(c)); });
    if (!leaves.empty()) add_level(l, std::move(leaves));
  }
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
  return {std::move(cells), std::move(sizes), lattice_->corner()};
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

std::vector<hexmesh::Element> form_elements(const Lattice& lattice, const MeshCells::OfLevel& of) {
  if (of.element.empty()) return hexmesh::form_elements(lattice, of.level);
  hexmesh::ElementTree tree(lattice);
  std::vector<hexmesh::Element> out;
  for (const std::int32_t e : of.element) out.push_back(tree.form(of.level, e));
  return out;
}

}  // namespace hexsolver
