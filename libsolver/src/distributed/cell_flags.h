// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "distributed/shared_level.h"

namespace hexsolver::mpi {

/// Some cells of a level, told to other processes by way of nodes: a cell is known by its first node, and by an axis of
/// that where several stand at one index. Called by all processes at once.
class CellFlags {
public:
  /// @param of_part  of each cell of this process's part
  CellFlags(const SharedLevel& level, const std::vector<bool>& of_part);

  /// Of any cells of the level.
  std::vector<bool> of(const std::vector<Piece::Holder>& cells) const;

private:
  const SharedLevel& level_;
  OwnedVec flags_;
};

}  // namespace hexsolver::mpi
