// SPDX-License-Identifier: Apache-2.0
#include "distributed/processes.h"

#include <exception>

namespace hexsolver::mpi {
namespace {

/// A value of some bytes as MPI counts it, so that numbers of values and not of bytes have to fit an int.
class ValueType {
public:
  explicit ValueType(std::size_t size) {
    MPI_Type_contiguous(static_cast<int>(size), MPI_BYTE, &type_);
    MPI_Type_commit(&type_);
  }
  ~ValueType() { MPI_Type_free(&type_); }
  ValueType(const ValueType&) = delete;
  ValueType& operator=(const ValueType&) = delete;
  operator MPI_Datatype() const { return type_; }

private:
  MPI_Datatype type_ = MPI_DATATYPE_NULL;
};

std::vector<int> starts(const std::vector<int>& sizes) {
  std::vector<int> out(sizes.size());
  std::exclusive_scan(sizes.begin(), sizes.end(), out.begin(), 0);
  return out;
}

}  // namespace

Processes::Processes(MPI_Comm comm) : comm_(comm) {
  MPI_Comm_rank(comm, &rank_);
  MPI_Comm_size(comm, &count_);
}

double Processes::reduce(double value, MPI_Op op) const {
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, op, comm_);
  return value;
}

void Processes::reduce(void* values, std::size_t count, MPI_Datatype type, MPI_Op op) const {
  MPI_Allreduce(MPI_IN_PLACE, values, static_cast<int>(count), type, op, comm_);
}

std::size_t Processes::sum(std::size_t value) const { return sum(std::vector<std::uint64_t>{value})[0]; }

std::vector<std::uint64_t> Processes::sum(std::vector<std::uint64_t> values) const {
  MPI_Allreduce(MPI_IN_PLACE, values.data(), static_cast<int>(values.size()), MPI_UINT64_T, MPI_SUM, comm_);
  return values;
}

std::size_t Processes::sum_before(std::size_t value) const {
  std::uint64_t mine = value, before = 0;
  MPI_Exscan(&mine, &before, 1, MPI_UINT64_T, MPI_SUM, comm_);
  return rank_ == 0 ? 0 : before;
}

void Processes::exchange_values(const void* send, const std::vector<int>& sizes, void* receive,
                                const std::vector<int>& from_sizes, std::size_t value_size) const {
  const ValueType type(value_size);
  MPI_Alltoallv(send, sizes.data(), starts(sizes).data(), type, receive, from_sizes.data(), starts(from_sizes).data(),
                type, comm_);
}

void Processes::gather_values(const void* mine, int size, void* all, const std::vector<int>& sizes,
                              std::size_t value_size) const {
  const ValueType type(value_size);
  MPI_Allgatherv(mine, size, type, all, sizes.data(), starts(sizes).data(), type, comm_);
}

std::string Processes::of_first(std::string text) const {
  const std::vector<char> all = gather(is_first() ? std::vector<char>(text.begin(), text.end()) : std::vector<char>());
  return {all.begin(), all.end()};
}

void Processes::in_turn(const std::function<void()>& f) const {
  for (int turn = 0; turn < count_; ++turn)
    all_or_none([&] {
      if (turn == rank_) f();
    });
}

void Processes::all_or_none(const std::function<void()>& f) const {
  std::string message;
  int kind = -1;
  try {
    f();
  } catch (const hexmesh::Error& e) {
    message = e.what();
    kind = static_cast<int>(e.kind());
  }
  const int failing = static_cast<int>(least(kind < 0 ? count_ : rank_));
  if (failing == count_) return;
  const std::vector<char> words =
      gather(failing == rank_ ? std::vector<char>(message.begin(), message.end()) : std::vector<char>());
  const std::vector<int> kinds = gather(failing == rank_ ? std::vector<int>{kind} : std::vector<int>());
  throw SharedError(static_cast<hexmesh::ErrorKind>(kinds[0]), {words.begin(), words.end()});
}

}  // namespace hexsolver::mpi
