// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "cell_product.h"
#include "hexsolver/mesh.h"
#include "hexsolver/term.h"

namespace hexsolver {

/// Symmetric matrices (24, 24) of the cells of a mesh, to be multiplied with: one where all cells of a batch are alike,
/// packed side by side elsewhere.
template <class Real>
class CellMatrices {
public:
  using Matrix = Eigen::Matrix<Real, 24, 24>;
  using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;

  CellMatrices() = default;
  /// @param mesh    must outlive this
  /// @param shared  number of the matrix that a cell shares, or Term::own_hessian; empty = all have their own
  explicit CellMatrices(const Mesh& mesh, std::vector<std::int32_t> shared = {});

  bool shares() const noexcept { return !shared_.empty(); }
  bool is_empty() const noexcept { return place_of_batch_.empty(); }

  /// Of a cell that has its own.
  void set(std::size_t cell, const CellMatrix& k) {
    const std::size_t batch = mesh_->batch_of(cell);
    packed_[packed_place(batch)].set(cell - mesh_->batches()[batch].first, k);
  }

  /// Of all cells that share one.
  /// @param matrix_of  number -> matrix
  template <class F>
  void set_shared(F&& matrix_of);

  CellMatrix get(std::size_t cell) const;

  /// Number of the matrix that a cell shares, or Term::own_hessian.
  std::int32_t shared(std::size_t cell) const { return shared_.empty() ? Term::own_hessian : shared_[cell]; }

  /// The matrix of all cells of a batch; null where they differ.
  const Real* alike(std::size_t batch) const {
    const std::int32_t place = place_of_batch_[batch];
    return place < 0 ? nullptr : alike_[static_cast<std::size_t>(place)].data();
  }
  /// Those of a batch whose cells differ.
  const SymmetricCells<Real>& packed(std::size_t batch) const { return packed_[packed_place(batch)]; }

  void add_product(const Vector& x, Vector& y) const;  ///< y += sum over cells of K x

  std::size_t bytes() const;  ///< of memory

private:
  std::size_t packed_place(std::size_t batch) const { return static_cast<std::size_t>(-1 - place_of_batch_[batch]); }

  const Mesh* mesh_ = nullptr;
  std::vector<std::int32_t> shared_;
  std::vector<std::int32_t> place_of_batch_;   ///< n: alike_[n]; -1 - n: packed_[n]
  std::vector<std::int32_t> number_of_alike_;  ///< alike_[n] -> number of the matrix that cells share
  std::vector<Matrix> alike_;
  std::vector<SymmetricCells<Real>> packed_;
};

template <class Real>
template <class F>
void CellMatrices<Real>::set_shared(F&& matrix_of) {
  for (std::size_t n = 0; n < alike_.size(); ++n)
    alike_[n] = CellMatrix(matrix_of(number_of_alike_[n])).template cast<Real>();
  for (std::size_t b = 0; b < place_of_batch_.size(); ++b) {
    if (place_of_batch_[b] >= 0) continue;
    const Mesh::Batch& batch = mesh_->batches()[b];
    for (std::size_t c = batch.first; c < batch.first + batch.count; ++c)
      if (shared(c) != Term::own_hessian) set(c, matrix_of(shared_[c]));
  }
}

}  // namespace hexsolver
