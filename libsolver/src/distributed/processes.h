// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mpi.h>

#include <functional>
#include <numeric>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "distributed/shared_equilibrium.h"

namespace hexsolver::mpi {

/// The processes of a run. All but rank() and count() are called by all of them, in the same order.
class Processes {
public:
  explicit Processes(MPI_Comm comm);

  MPI_Comm comm() const noexcept { return comm_; }
  int rank() const noexcept { return rank_; }
  int count() const noexcept { return count_; }
  bool is_first() const noexcept { return rank_ == 0; }

  double sum(double value) const { return reduce(value, MPI_SUM); }
  double least(double value) const { return reduce(value, MPI_MIN); }
  double largest(double value) const { return reduce(value, MPI_MAX); }
  std::size_t sum(std::size_t value) const;
  std::vector<std::uint64_t> sum(std::vector<std::uint64_t> values) const;
  void add_up(std::span<double> values) const { reduce(values.data(), values.size(), MPI_DOUBLE, MPI_SUM); }
  void add_up(std::span<float> values) const { reduce(values.data(), values.size(), MPI_FLOAT, MPI_SUM); }
  void take_least(std::span<double> values) const { reduce(values.data(), values.size(), MPI_DOUBLE, MPI_MIN); }
  std::size_t sum_before(std::size_t value) const;  ///< of the processes of lower rank

  /// @param to  what goes to each process; @returns what came from each
  template <class T>
  std::vector<std::vector<T>> exchange(const std::vector<std::vector<T>>& to) const {
    static_assert(std::is_trivially_copyable_v<T>);
    std::vector<int> sizes;
    std::vector<T> all;
    for (const std::vector<T>& part : to) {
      sizes.push_back(static_cast<int>(part.size()));
      all.insert(all.end(), part.begin(), part.end());
    }
    std::vector<int> from_sizes(sizes.size());
    MPI_Alltoall(sizes.data(), 1, MPI_INT, from_sizes.data(), 1, MPI_INT, comm_);
    std::vector<T> received(static_cast<std::size_t>(std::accumulate(from_sizes.begin(), from_sizes.end(), 0)));
    exchange_values(all.data(), sizes, received.data(), from_sizes, sizeof(T));
    std::vector<std::vector<T>> from;
    auto at = received.begin();
    for (const int n : from_sizes) {
      from.emplace_back(at, at + n);
      at += n;
    }
    return from;
  }

  /// Everybody's values, in the order of ranks, for everybody.
  template <class T>
  std::vector<T> gather(const std::vector<T>& mine) const {
    static_assert(std::is_trivially_copyable_v<T>);
    const int size = static_cast<int>(mine.size());
    std::vector<int> sizes(static_cast<std::size_t>(count_));
    MPI_Allgather(&size, 1, MPI_INT, sizes.data(), 1, MPI_INT, comm_);
    std::vector<T> all(static_cast<std::size_t>(std::accumulate(sizes.begin(), sizes.end(), 0)));
    gather_values(mine.data(), size, all.data(), sizes, sizeof(T));
    return all;
  }

  /// The first process's.
  std::string of_first(std::string text) const;

  /// f(), one process after the other. @throws SharedError as all_or_none()
  void in_turn(const std::function<void()>& f) const;

  /// f() by all at once, which calls others of these only in ways that all of them do.
  /// @throws SharedError on every process if f throws hexmesh::Error on one
  void all_or_none(const std::function<void()>& f) const;

private:
  void reduce(void* values, std::size_t count, MPI_Datatype type, MPI_Op op) const;
  double reduce(double value, MPI_Op op) const;
  void exchange_values(const void* send, const std::vector<int>& sizes, void* receive,
                       const std::vector<int>& from_sizes, std::size_t value_size) const;
  void gather_values(const void* mine, int size, void* all, const std::vector<int>& sizes,
                     std::size_t value_size) const;

  MPI_Comm comm_;
  int rank_ = 0, count_ = 1;
};

}  // namespace hexsolver::mpi
