// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "distributed/piece.h"

namespace hexsolver::mpi {

/// The cells of a level that a process works on.
struct Part {
  Index3 low{};  ///< index of its cell (0, 0, 0) in the whole, a multiple of the blocks that go to one process
  KeyedCells keys;
  std::vector<Index3> voxels;  ///< of each cell one of its own, in the whole; empty where each index has one cell
  hexmesh::Lattice lattice;    ///< of these cells on the level, and nothing on others
};

/// Divide the cells that all have read along a space-filling curve. Called by all processes at once.
/// @param block  of cells that go to one process
Part take_part(const Processes& all, const hexmesh::LatticeReader& file, const hexmesh::Lattice& outline, int level,
               Piece& piece, const Index3& block);

}  // namespace hexsolver::mpi
