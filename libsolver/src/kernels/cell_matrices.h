// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "kernels/matrix_number.h"
#include "kernels/mirrored_matrix.h"
#include "kernels/shared_batches.h"
#include "kernels/symmetric_product.h"
#include "mesh/mesh.h"

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
  /// @param shared  number of the matrix that a cell shares, or own_matrix; empty = all have their own
  explicit CellMatrices(const Mesh& mesh, std::vector<std::int32_t> shared = {});

  bool shares() const noexcept { return !shared_.empty(); }
  bool is_empty() const noexcept { return batches_.is_empty(); }

  /// Of a cell that has its own.
  void set(std::size_t cell, const CellMatrix& k) {
    packed_[batches_.single_place(mesh_->batch_of(cell))].set(mesh_->lane_of(cell), k);
  }

  /// Of all cells that share one.
  /// @param matrix_of  number -> matrix
  template <class F>
  void set_shared(F&& matrix_of);

  CellMatrix get(std::size_t cell) const;

  /// Number of the matrix that a cell shares, or own_matrix.
  std::int32_t shared(std::size_t cell) const { return shared_.empty() ? own_matrix : shared_[cell]; }

  /// The matrix of all cells of a batch; nothing where they differ.
  AlikeMatrix<Real> alike(std::size_t batch) const {
    return batches_.is_shared(batch) ? alike_[batches_.shared_place(batch)].view() : AlikeMatrix<Real>{};
  }
  /// Those of a batch whose cells differ.
  const SymmetricCells<Real>& packed(std::size_t batch) const { return packed_[batches_.single_place(batch)]; }

  void add_product(const Vector& x, Vector& y) const;  ///< y += sum over cells of K x

  std::size_t bytes() const;  ///< of memory

private:
  struct Alike {
    Matrix full;
    std::optional<MirroredMatrix<Real>> mirrored;
    AlikeMatrix<Real> view() const { return {full.data(), mirrored ? &*mirrored : nullptr}; }
  };

  const Mesh* mesh_ = nullptr;
  std::vector<std::int32_t> shared_;
  SharedBatches batches_;
  std::vector<Alike> alike_;                  ///< as batches_.shared()
  std::vector<SymmetricCells<Real>> packed_;  ///< of the other batches
};

template <class Real>
template <class F>
void CellMatrices<Real>::set_shared(F&& matrix_of) {
  for (std::size_t n = 0; n < alike_.size(); ++n) {
    const CellMatrix k = matrix_of(batches_.shared()[n].number);
    alike_[n].full = k.template cast<Real>();
    alike_[n].mirrored.reset();
    if (const auto blocks = mirrored(k)) alike_[n].mirrored = blocks->template cast<Real>();
  }
  for (std::size_t b = 0; b < mesh_->batches().size(); ++b) {
    if (batches_.is_shared(b)) continue;
    const Mesh::Batch& batch = mesh_->batches()[b];
    for (std::size_t c = batch.first; c < batch.end(); ++c)
      if (shared(c) != own_matrix) set(c, matrix_of(shared_[c]));
  }
}

}  // namespace hexsolver
