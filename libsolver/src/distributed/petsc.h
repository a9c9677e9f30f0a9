// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <petscksp.h>

#include <stdexcept>
#include <utility>
#include <vector>

#include "mesh/mesh.h"

namespace hexsolver::mpi {

/// What PETSc could not do is a mistake of ours; the first process's PETSc has said more on standard error.
inline void check(PetscErrorCode code) {
  if (code != 0) throw std::runtime_error("PETSc failed");
}

/// Owns an object of PETSc's.
template <class Object, PetscErrorCode (*destroy)(Object*)>
class Owned {
public:
  Owned() = default;
  ~Owned() { destroy(&object_); }
  Owned(Owned&& other) noexcept : object_(std::exchange(other.object_, nullptr)) {}
  Owned& operator=(Owned&& other) noexcept {
    std::swap(object_, other.object_);
    return *this;
  }
  operator Object() const { return object_; }
  Object* address() { return &object_; }

private:
  Object object_ = nullptr;
};

using OwnedVec = Owned<Vec, VecDestroy>;
using OwnedMat = Owned<Mat, MatDestroy>;
using OwnedIs = Owned<IS, ISDestroy>;
using OwnedScatter = Owned<VecScatter, VecScatterDestroy>;
using OwnedKsp = Owned<KSP, KSPDestroy>;

inline double dot(Vec x, Vec y) {
  PetscScalar out = 0;
  check(VecDot(x, y, &out));
  return out;
}

inline double norm(Vec x, NormType type = NORM_2) {
  PetscReal out = 0;
  check(VecNorm(x, type, &out));
  return out;
}

/// A vector like another, zero.
inline OwnedVec zero_like(Vec x) {
  OwnedVec out;
  check(VecDuplicate(x, out.address()));
  check(VecZeroEntries(out));
  return out;
}

/// Copies of some nodes' values, wherever they are kept.
class NodeCopies {
public:
  NodeCopies() = default;
  /// @param field    a vector of three values per node, by processes
  /// @param numbers  of the nodes copied
  NodeCopies(Vec field, const std::vector<PetscInt>& numbers) {
    const auto count = static_cast<PetscInt>(numbers.size());
    OwnedIs from;
    check(ISCreateBlock(PETSC_COMM_SELF, 3, count, numbers.data(), PETSC_COPY_VALUES, from.address()));
    check(VecCreateSeq(PETSC_COMM_SELF, 3 * count, copies_.address()));
    check(VecScatterCreate(field, from, copies_, nullptr, scatter_.address()));
  }

  /// Called by all processes at once, as both below.
  void get(Vec field, NodeVector& out) const {
    check(VecScatterBegin(scatter_, field, copies_, INSERT_VALUES, SCATTER_FORWARD));
    check(VecScatterEnd(scatter_, field, copies_, INSERT_VALUES, SCATTER_FORWARD));
    const PetscScalar* values = nullptr;
    PetscInt size = 0;
    check(VecGetLocalSize(copies_, &size));
    check(VecGetArrayRead(copies_, &values));
    out = Eigen::Map<const NodeVector>(values, size);
    check(VecRestoreArrayRead(copies_, &values));
  }

  void add_to(const NodeVector& values, Vec field) const { put(values, field, ADD_VALUES); }

  /// The largest of what the processes have for each node, and of what is there.
  void raise_to(const NodeVector& values, Vec field) const { put(values, field, MAX_VALUES); }

private:
  void put(const NodeVector& values, Vec field, InsertMode mode) const {
    PetscScalar* to = nullptr;
    check(VecGetArray(copies_, &to));
    std::copy(values.begin(), values.end(), to);
    check(VecRestoreArray(copies_, &to));
    check(VecScatterBegin(scatter_, copies_, field, mode, SCATTER_REVERSE));
    check(VecScatterEnd(scatter_, copies_, field, mode, SCATTER_REVERSE));
  }

  OwnedScatter scatter_;
  OwnedVec copies_;
};

}  // namespace hexsolver::mpi
