// SPDX-License-Identifier: Apache-2.0
#include "kernels/cell_matrices.h"

#include "hexmesh/core/bytes.h"
#include "kernels/alike_product.h"

namespace hexsolver {

using hexmesh::bytes_of;

template <class Real>
CellMatrices<Real>::CellMatrices(const Mesh& mesh, std::vector<std::int32_t> shared)
    : mesh_(&mesh), shared_(std::move(shared)) {
  batches_.find(mesh, [this](std::size_t cell) { return this->shared(cell); });
  alike_.resize(batches_.shared().size());
  packed_.resize(batches_.num_single());
}

template <class Real>
CellMatrix CellMatrices<Real>::get(std::size_t cell) const {
  const std::size_t batch = mesh_->batch_of(cell);
  if (batches_.is_shared(batch)) return alike_[batches_.shared_place(batch)].full.template cast<double>();
  return packed(batch).get(mesh_->lane_of(cell));
}

template <class Real>
void CellMatrices<Real>::add_product(const Vector& x, Vector& y) const {
  mesh_->for_each_batch([&](std::size_t b) {
    if (batches_.is_shared(b))
      add_alike_product(alike(b), nodes_of_batch(*mesh_, b), x.data(), y.data());
    else
      add_symmetric_product(packed(b), nodes_of_batch(*mesh_, b), x.data(), y.data());
  });
}

template <class Real>
std::size_t CellMatrices<Real>::bytes() const {
  return bytes_of(shared_) + batches_.bytes() + bytes_of(alike_) + bytes_of(packed_);
}

template class CellMatrices<float>;
template class CellMatrices<double>;

}  // namespace hexsolver
