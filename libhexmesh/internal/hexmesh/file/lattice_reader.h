// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "hexmesh/file/lattice_file.h"
#include "hexmesh/lattice/lattice.h"

namespace hexmesh {

namespace hdf5 {
class Reader;
}

/// Some layers of a level's cells, with others around them: a lattice whose box begins with the lowest of these.
struct LatticePiece {
  Lattice lattice;              ///< only `level` has cells; without surface
  std::int32_t low = 0;         ///< layer k of the piece is layer k + low of the whole
  std::int32_t begin = 0;       ///< of the layers that it stands for, counted in the piece
  std::int32_t end = 0;         ///< one past them
  std::int32_t num_layers = 0;  ///< of the piece
  std::size_t first_cell = 0;   ///< of its own cells, counted in the piece; they lie one after the other
  std::size_t num_own_cells = 0;
  std::size_t first_row = 0;  ///< of its own cells in the file
};

/// Reads parts of a lattice file, in memory that grows with the part and not with the whole.
/// All throw Error{input} naming the file and what is wrong with it.
class LatticeReader {
public:
  explicit LatticeReader(const std::filesystem::path& path, Elements elements = Elements::formed);
  ~LatticeReader();

  /// Box, segments, materials, levels and history; no voxels, cells, elements or surface.
  Lattice outline() const;

  std::size_t num_cells(int level) const;

  /// How many of the cells in rows `first` to `first` + `count` - 1 lie in each layer k; shape (layers of the level).
  std::vector<std::uint64_t> cells_in_layers(int level, std::size_t first, std::size_t count) const;

  /// @param outline     see above, its materials may differ
  /// @param first_rows  row of the first cell of each layer, and the number of cells; shape (layers + 1)
  /// @param begin, end  layers that the piece stands for
  /// @param margin      layers around these
  LatticePiece read_layers(const Lattice& outline, int level, const std::vector<std::uint64_t>& first_rows,
                           std::int32_t begin, std::int32_t end, std::int32_t margin) const;

  /// The elements that some cells are made of, in lattice.levels; the cells' numbers of them become those there.
  /// @param elements  of cells of `level`, as the file numbers them
  void read_elements(Lattice& lattice, int level, std::vector<std::int32_t>& elements) const;

  /// Which voxels are whose on a level whose cells are split, in the whole.
  VoxelOwners owners(int level) const;

private:
  std::size_t num_elements(int level, const Lattice& lattice) const;

  std::unique_ptr<const hdf5::Reader> file_;
  Elements source_;
};

}  // namespace hexmesh
