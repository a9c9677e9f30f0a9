// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "kernels/shared_batches.h"
#include "kernels/vector_product.h"
#include "terms/term.h"

namespace hexsolver {

/// Passes over fewer cells take less time than the threads to wake up.
inline constexpr std::size_t cells_worth_threads = 4000;

/// A vector (24) of each cell of a mesh, to be multiplied with: cells of batches that are all alike share theirs.
template <class Real>
class CellRows {
public:
  /// @param mesh  must outlive this
  explicit CellRows(const Mesh& mesh) : mesh_(mesh) {}

  /// @param of      cell -> vector
  /// @param shared  cell -> its number; cells of one number >= 0 have the same
  template <class Of, class Shared>
  void set(const Of& of, const Shared& shared) {
    batches_.find(mesh_, shared);
    alike_.resize(batches_.shared().size());
    for (std::size_t n = 0; n < alike_.size(); ++n) {
      const CellVector v = of(batches_.shared()[n].first_cell);
      for (std::size_t lane = 0; lane < Mesh::batch_size; ++lane) alike_[n].set(lane, v);
    }
    each_.resize(batches_.num_single());
#pragma omp parallel for schedule(static)
    for (std::size_t b = 0; b < mesh_.batches().size(); ++b) {
      if (batches_.is_shared(b)) continue;
      const Mesh::Batch& batch = mesh_.batches()[b];
      LaneVectors<Real>& each = each_[batches_.single_place(b)];
      for (std::size_t lane = 0; lane < batch.count; ++lane) each.set(lane, of(batch.first + lane));
    }
  }

  const LaneVectors<Real>& of_batch(std::size_t batch) const {
    return batches_.is_shared(batch) ? alike_[batches_.shared_place(batch)] : each_[batches_.single_place(batch)];
  }

  const SharedBatches& batches() const noexcept { return batches_; }

  /// Shape (3, 8): columns = nodes of the cell.
  auto get(std::size_t cell) const { return of_batch(mesh_.batch_of(cell)).get(mesh_.lane_of(cell)); }

  std::size_t bytes() const { return batches_.bytes() + hexmesh::bytes_of(alike_) + hexmesh::bytes_of(each_); }

private:
  const Mesh& mesh_;
  SharedBatches batches_;
  std::vector<LaneVectors<Real>> alike_;  ///< as batches_.shared(), the same vector in all lanes
  std::vector<LaneVectors<Real>> each_;   ///< of the other batches
};

}  // namespace hexsolver
