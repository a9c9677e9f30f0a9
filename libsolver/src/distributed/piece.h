// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "distributed/shared_nodes.h"
#include "hexmesh/file/lattice_reader.h"
#include "mesh/mesh.h"
#include "selection/selection.h"

namespace hexsolver::mpi {

/// The layers of a level that a process reads of the file, and those around them: selections, surface and results go by
/// these. Indices are the piece's; in_whole() are the level's.
class Piece {
public:
  /// Layers around those that a piece stands for: what cells and nodes of these touch.
  static constexpr std::int32_t margin = 1;

  /// Called by all processes at once; all must outlive this.
  Piece(const Processes& all, const hexmesh::LatticeReader& file, const hexmesh::Lattice& outline, int level,
        std::size_t num_cells);
  Piece(const Piece&) = delete;
  Piece& operator=(const Piece&) = delete;

  const Layers& layers() const noexcept { return layers_; }  ///< of all processes
  const hexmesh::LatticePiece& rows() const noexcept { return *piece_; }
  const hexmesh::Lattice& lattice() const noexcept { return piece_->lattice; }
  const hexmesh::Level& level() const { return piece_->lattice.levels[static_cast<std::size_t>(level_)]; }
  const Mesh& mesh() const { return *mesh_; }
  const SurfaceShare& share() const { return *share_; }
  std::vector<Index3> in_whole(std::vector<Index3> indices) const {
    return shifted(std::move(indices), {0, 0, piece_->low});
  }

  /// Elements of the layers' own cells as the file numbers them; given away.
  std::vector<std::int32_t> take_elements_in_file() { return std::move(elements_in_file_); }

private:
  Piece(const Processes& all, const hexmesh::LatticeReader& file, const hexmesh::Lattice& outline, int level,
        const std::vector<std::uint64_t>& first_rows);

  int level_;
  Layers layers_;
  std::optional<hexmesh::LatticePiece> piece_;
  std::vector<std::int32_t> elements_in_file_;
  std::unique_ptr<Mesh> mesh_;
  std::unique_ptr<SurfaceShare> share_;
};

}  // namespace hexsolver::mpi
