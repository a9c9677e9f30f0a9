// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <petscsys.h>

#include <algorithm>
#include <vector>

#include "distributed/keys.h"
#include "distributed/processes.h"

namespace hexsolver::mpi {

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

/// Ask processes, and answer what others ask. Called by all at once.
/// @param process_of  request -> the process that knows
/// @param answer      request -> T
/// @returns answers to the requests of this process
template <class T, class Request, class ProcessOf, class Answer>
std::vector<T> ask(const Processes& all, const std::vector<Request>& requests, const ProcessOf& process_of,
                   const Answer& answer) {
  const auto count = static_cast<std::size_t>(all.count());
  std::vector<std::vector<Request>> to(count);
  std::vector<std::vector<std::size_t>> places(count);
  for (std::size_t n = 0; n < requests.size(); ++n) {
    const auto process = static_cast<std::size_t>(process_of(requests[n]));
    to[process].push_back(requests[n]);
    places[process].push_back(n);
  }
  std::vector<std::vector<T>> answers;
  for (const std::vector<Request>& of_process : all.exchange(to)) {
    std::vector<T>& own = answers.emplace_back();
    for (const Request& request : of_process) own.push_back(answer(request));
  }
  const std::vector<std::vector<T>> got = all.exchange(answers);
  std::vector<T> out(requests.size());
  for (std::size_t p = 0; p < count; ++p)
    for (std::size_t n = 0; n < got[p].size(); ++n) out[places[p][n]] = got[p][n];
  return out;
}

/// The nodes of a level, each known to those processes that have a cell at it and owned by one of them. Owners number
/// theirs one after the other, process after process, as PETSc does.
class SharedNodes {
public:
  /// @param keys  of the nodes that this process uses; distinct
  SharedNodes(const Processes& all, const Layers& layers, const std::vector<Key>& keys);

  const std::vector<PetscInt>& numbers() const noexcept { return numbers_; }  ///< of the keys
  PetscInt first_own() const noexcept { return first_own_; }
  PetscInt num_own() const noexcept { return num_own_; }
  PetscInt num_all() const noexcept { return num_all_; }
  bool owns(PetscInt number) const noexcept { return number >= first_own_ && number < first_own_ + num_own_; }

  /// Numbers of any nodes; -1 for those that nobody uses. Called by all processes at once.
  std::vector<PetscInt> find(const std::vector<Key>& keys) const;

private:
  struct Entry {
    Key key;
    int owner;
    PetscInt number;
  };
  int process_of(const Key& key) const { return layers_.process_of(key.index[2]); }  ///< that looks after it
  std::vector<std::vector<Key>> sort_by_process(const std::vector<Key>& keys) const;
  const Entry* entry_of(const Key& key) const;

  const Processes& all_;
  Layers layers_;
  std::vector<Entry> entries_;  ///< that this process looks after, sorted
  std::vector<PetscInt> numbers_;
  PetscInt first_own_ = 0, num_own_ = 0, num_all_ = 0;
};

/// Who gets which cells: pieces of a space-filling curve with about as many cells each.
/// Source: G. M. Morton, "A computer oriented geodetic data base and a new technique in file sequencing", IBM (1966).
/// @param cells  of this process
/// @returns the process that each goes to
std::vector<int> partition_along_curve(const Processes& all, const std::vector<Index3>& cells);

}  // namespace hexsolver::mpi
