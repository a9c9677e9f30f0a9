// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "hexmesh/lattice/lattice.h"
#include "hexmesh/lattice/merge.h"
#include "mesh/mesh.h"

namespace hexsolver {

/// The cells of a lattice that a mesh is made of: all of one level, or leaves of the tree of several, none of which
/// holds another and which hold all material together.
class MeshCells {
public:
  /// Those of one level.
  struct OfLevel {
    int level = 0;
    std::size_t first = 0;              ///< number of the first in the mesh
    std::vector<std::int32_t> cells;    ///< their numbers in the level, ascending; empty: all
    std::vector<std::int32_t> element;  ///< the elements of these cells, ascending; empty: all of the level
    std::size_t first_element = 0;      ///< number of the first in elements()
  };

  /// All cells of a level. The lattice must outlive this.
  MeshCells(const hexmesh::Lattice& lattice, int level);

  /// Whether a cell of a level is too large.
  using IsTooLarge = std::function<bool(int level, const Index3& cell)>;
  /// Leaves: of the cells of the level `coarsest` those that are too large are divided, and so on to the level
  /// `finest`; then more, so that cells that touch differ by one level at most.
  MeshCells(const hexmesh::Lattice& lattice, int finest, int coarsest, const IsTooLarge& is_too_large);

  const hexmesh::Lattice& lattice() const noexcept { return *lattice_; }
  int level() const noexcept { return level_; }                            ///< the finest that there may be cells of
  const std::vector<OfLevel>& levels() const noexcept { return levels_; }  ///< that there are cells of, finest first
  bool is_graded() const noexcept { return levels_.size() > 1 || levels_.front().level != level_; }
  /// Voxels in a unit of the nodes' indices of the mesh.
  const Index3& unit() const noexcept { return lattice_->level(levels_.front().level).voxels_per_cell; }
  std::size_t size() const noexcept { return size_; }

  /// Where a cell of the mesh is in the lattice.
  struct Place {
    int level = 0;
    std::int32_t cell = 0;
  };
  Place place(std::size_t cell) const {
    const OfLevel& of = level_of(cell);
    const std::size_t n = cell - of.first;
    return {of.level, of.cells.empty() ? static_cast<std::int32_t>(n) : of.cells[n]};
  }
  const hexmesh::Level& lattice_level(std::size_t cell) const { return lattice_->level(level_of(cell).level); }

  Mesh make_mesh() const;

  /// Those that are to be divided, with all that stand at their index, into the cells of the next finer level that they
  /// hold; then more, so that cells that touch differ by one level at most. Cells of level 0 stay.
  MeshCells divided(const std::vector<bool>& which) const;

  /// Of cells of several levels: the finest merged into those of the next level. @pre is_graded()
  MeshCells coarser() const;

  /// The cell that holds one of a level, which is none of coarser ones of these; -1 if there is none.
  std::int32_t holder(int level, std::int32_t cell) const;
  /// The cell of a voxel that has a material; -1 if there is none.
  std::int32_t cell_of_voxel(const Index3& voxel) const;

  /// The element of each cell, all levels' that occur numbered one after the other.
  std::vector<std::int32_t> elements() const;
  std::size_t num_elements() const noexcept { return num_elements_; }

private:
  const OfLevel& level_of(std::size_t cell) const {
    std::size_t l = levels_.size() - 1;
    while (levels_[l].first > cell) --l;
    return levels_[l];
  }
  MeshCells() = default;  // of nothing
  void add_level(int level, std::vector<std::int32_t> cells);
  /// Of a level's cell its number in the mesh; -1 if it is not there.
  static std::int32_t number(const OfLevel& of, std::int32_t cell);

  const hexmesh::Lattice* lattice_ = nullptr;
  int level_ = 0;
  std::vector<OfLevel> levels_;
  std::size_t size_ = 0, num_elements_ = 0;
};

/// The cell of coarser ones, or of the same, that each cell is in.
std::vector<std::int32_t> holders(const MeshCells& of, const MeshCells& in);

/// How cells merge into fine.coarser().
hexmesh::Merge merge_into(const MeshCells& fine, const MeshCells& coarse);

/// The elements of some of a level's, or of all where none are named.
std::vector<hexmesh::Element> form_elements(const hexmesh::Lattice& lattice, const MeshCells::OfLevel& of);

}  // namespace hexsolver
