// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <petscsys.h>

#include <algorithm>
#include <vector>

#include "distributed/processes.h"
#include "hexmesh/core/grid.h"

namespace hexsolver::mpi {

using hexmesh::Index3;

/// The order of cells and nodes in files: i fastest.
inline bool before(const Index3& a, const Index3& b) {
  return std::array{a[2], a[1], a[0]} < std::array{b[2], b[1], b[0]};
}

/// Of an index among those sorted by before(); -1: not there.
inline std::int32_t place_of(const std::vector<Index3>& sorted, const Index3& index) {
  const auto found = std::lower_bound(sorted.begin(), sorted.end(), index, before);
  return found != sorted.end() && *found == index ? static_cast<std::int32_t>(found - sorted.begin()) : -1;
}

/// Indices of a part as those of the whole, or the other way.
inline std::vector<Index3> shifted(std::vector<Index3> indices, const Index3& by) {
  for (Index3& i : indices) i = {i[0] + by[0], i[1] + by[1], i[2] + by[2]};
  return indices;
}

/// Which process looks after the entries of which layers k of a level: as many cells for each as layers allow.
class Layers {
public:
  /// @param first_rows       row of the first cell of each layer, and the number of cells
  Layers(const Processes& all, const std::vector<std::uint64_t>& first_rows);
  /// The same layers on a level whose cells are `factor` times as large along k.
  Layers(const Layers& finer, int factor);

  std::int32_t begin(int process) const { return begins_[static_cast<std::size_t>(process)]; }
  std::int32_t end(int process) const { return begins_[static_cast<std::size_t>(process) + 1]; }
  int process_of(std::int32_t layer) const;  ///< the last one for layers beyond the end

private:
  std::vector<std::int32_t> begins_;
};

/// The nodes of a level, each known to those processes that have a cell at it and owned by one of them. Owners number
/// theirs one after the other, process after process, as PETSc does.
class SharedNodes {
public:
  /// @param keys  lattice indices of the nodes that this process uses; distinct
  SharedNodes(const Processes& all, const Layers& layers, const std::vector<Index3>& keys);

  const std::vector<PetscInt>& numbers() const noexcept { return numbers_; }  ///< of the keys
  PetscInt first_own() const noexcept { return first_own_; }
  PetscInt num_own() const noexcept { return num_own_; }
  PetscInt num_all() const noexcept { return num_all_; }
  bool owns(PetscInt number) const noexcept { return number >= first_own_ && number < first_own_ + num_own_; }

  /// Numbers of any nodes; -1 for those that nobody uses. Called by all processes at once.
  std::vector<PetscInt> find(const std::vector<Index3>& keys) const;

private:
  struct Entry {
    Index3 key;
    int owner;
    PetscInt number;
  };
  /// Keys by the process that looks after them, and for each of these which of the keys they were.
  struct Requests {
    std::vector<std::vector<Index3>> keys;
    std::vector<std::vector<std::size_t>> places;
  };
  Requests sort_by_process(const std::vector<Index3>& keys) const;
  const Entry* entry_of(const Index3& key) const;
  /// What the processes that look after the keys answer.
  template <class T, class Answer>
  std::vector<T> ask(const std::vector<Index3>& keys, Answer answer) const;

  const Processes& all_;
  Layers layers_;
  std::vector<Entry> entries_;  ///< that this process looks after, sorted
  std::vector<PetscInt> numbers_;
  PetscInt first_own_ = 0, num_own_ = 0, num_all_ = 0;
};

/// Trilinear interpolation of a node from those of a level with cells `factor` as large: at most eight.
struct CoarseNode {
  Index3 key;
  double weight;
};
std::vector<CoarseNode> coarse_nodes_of(const Index3& node, const Index3& factor);

/// Who gets which cells: pieces of a space-filling curve with about as many cells each.
/// Source: G. M. Morton, "A computer oriented geodetic data base and a new technique in file sequencing", IBM (1966).
/// @param cells  of this process
/// @returns the process that each goes to
std::vector<int> partition_along_curve(const Processes& all, const std::vector<Index3>& cells);

}  // namespace hexsolver::mpi
