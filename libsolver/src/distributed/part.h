// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>
#include <vector>

#include "distributed/piece.h"

namespace hexsolver::mpi {

/// The way of cells from the processes that have read them to those that work on them.
class Journey {
public:
  /// @param goes_to  the process to which each of the cells goes that this one has read
  Journey(const Processes& all, std::vector<int> goes_to) : all_(all), goes_to_(std::move(goes_to)) {}

  const std::vector<int>& goes_to() const noexcept { return goes_to_; }
  /// Let what arrives be in this order from now on: numbers of what arrives.
  void arrange(std::vector<std::size_t> order) { order_ = std::move(order); }

  /// Called by all processes at once.
  /// @param value_of  of a cell that this process has read
  /// @returns of the cells that come here
  template <class T, class ValueOf>
  std::vector<T> send(const ValueOf& value_of) const {
    std::vector<std::vector<T>> to(static_cast<std::size_t>(all_.count()));
    for (std::size_t c = 0; c < goes_to_.size(); ++c) to[static_cast<std::size_t>(goes_to_[c])].push_back(value_of(c));
    std::vector<T> arrived;
    for (const std::vector<T>& from : all_.exchange(to)) arrived.insert(arrived.end(), from.begin(), from.end());
    if (order_.empty()) return arrived;
    std::vector<T> out;
    for (const std::size_t n : order_) out.push_back(arrived[n]);
    return out;
  }

private:
  const Processes& all_;
  std::vector<int> goes_to_;
  std::vector<std::size_t> order_;
};

/// The cells of a level that a process works on.
struct Part {
  Index3 low{};  ///< index of its cell (0, 0, 0) in the whole, a multiple of the blocks that go to one process
  KeyedCells keys;
  std::vector<Index3> voxels;  ///< of each cell one of its own, in the whole; empty where each index has one cell
  hexmesh::Lattice lattice;    ///< of these cells on the level, and nothing on others
  Journey journey;             ///< on which they came
};

/// What condensed cells of the part come to, from those that its pieces have read. Called by all processes at once.
/// @param of_piece  of the cells of this process's piece
hexmesh::CondensedLevel take_condensed(const Processes& all, const Piece& piece, const Part& part,
                                       const hexmesh::CondensedLevel& of_piece);

/// Divide the cells that all have read along a space-filling curve. Called by all processes at once.
/// @param block  of cells that go to one process
Part take_part(const Processes& all, const hexmesh::LatticeReader& file, const hexmesh::Lattice& outline, int level,
               Piece& piece, const Index3& block);

}  // namespace hexsolver::mpi
