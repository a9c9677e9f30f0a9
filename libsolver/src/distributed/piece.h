// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "distributed/shared_nodes.h"
#include "hexmesh/file/lattice_reader.h"
#include "hexmesh/lattice/locator.h"
#include "mesh/mesh.h"
#include "selection/selection.h"

namespace hexsolver::mpi {

/// The layers of a level that a process reads of the file, and those around them: selections, surface and results go by
/// these. Indices are the piece's; in_whole() are the level's.
class Piece {
public:
  /// Called by all processes at once; all must outlive this.
  /// @param margin  layers around those that the piece stands for: 1 has what cells and nodes of these touch, 2 what
  ///                makes those the same as in the whole, where nodes that one cell alone has count
  Piece(const Processes& all, const hexmesh::LatticeReader& file, const hexmesh::Lattice& outline, int level,
        std::size_t num_cells, std::int32_t margin = 1);
  Piece(const Piece&) = delete;
  Piece& operator=(const Piece&) = delete;

  const Layers& layers() const noexcept { return layers_; }  ///< of all processes
  const hexmesh::LatticePiece& rows() const noexcept { return *piece_; }
  const hexmesh::Lattice& lattice() const noexcept { return piece_->lattice; }
  const hexmesh::Level& level() const { return piece_->lattice.levels[static_cast<std::size_t>(level_)]; }
  const KeyedCells& keys() const noexcept { return keys_; }  ///< of its cells and nodes
  const Mesh& mesh() const { return *mesh_; }
  const SurfaceShare& share() const { return *share_; }

  /// The cells that hold voxels of the whole, whichever process has read them. Called by all processes at once.
  struct Holder {
    Key cell;
    CornerNumbers corners{};
  };
  std::vector<Holder> holders_of(const std::vector<Index3>& voxels) const;
  Holder cell(std::size_t number) const { return {keys_.cells[number], keys_.corners_of(number)}; }  ///< of the piece
  /// The lattice of its layers with all levels up to its own. Called by all processes at once.
  hexmesh::Lattice with_finer_levels(const hexmesh::LatticeReader& file, const hexmesh::Lattice& outline) const;

  /// Of each cell one of its voxels, in the whole.
  std::vector<Index3> some_voxels() const;

  /// Elements of the layers' own cells as the file numbers them; given away.
  std::vector<std::int32_t> take_elements_in_file() { return std::move(elements_in_file_); }

private:
  Piece(const Processes& all, const hexmesh::LatticeReader& file, const hexmesh::Lattice& outline, int level,
        const std::vector<std::uint64_t>& first_rows, std::int32_t margin);
  hexmesh::CellLocator locator() const;

  const Processes& all_;
  int level_;
  std::int32_t margin_;
  Layers layers_;
  std::optional<hexmesh::LatticePiece> piece_;
  KeyedCells keys_;
  std::vector<std::int32_t> elements_in_file_;
  std::unique_ptr<Mesh> mesh_;
  std::unique_ptr<SurfaceShare> share_;
};

}  // namespace hexsolver::mpi
