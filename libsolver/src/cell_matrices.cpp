// SPDX-License-Identifier: Apache-2.0
#include "cell_matrices.h"

#include <unordered_map>

#include "hexmesh/core/bytes.h"

namespace hexsolver {

using hexmesh::bytes_of;

template <class Real>
CellMatrices<Real>::CellMatrices(const Mesh& mesh, std::vector<std::int32_t> shared)
    : mesh_(&mesh), shared_(std::move(shared)) {
  std::unordered_map<std::int32_t, std::int32_t> place_of_number;
  std::int32_t num_packed = 0;
  for (const Mesh::Batch& batch : mesh.batches()) {
    const std::int32_t number = this->shared(batch.first);
    bool alike = number != Term::own_hessian;
    for (std::size_t c = batch.first; c < batch.first + batch.count; ++c) alike = alike && this->shared(c) == number;
    if (!alike) {
      place_of_batch_.push_back(-1 - num_packed++);
      continue;
    }
    const auto [entry, is_new] =
        place_of_number.try_emplace(number, static_cast<std::int32_t>(number_of_alike_.size()));
    if (is_new) number_of_alike_.push_back(number);
    place_of_batch_.push_back(entry->second);
  }
  alike_.resize(number_of_alike_.size());
  packed_.resize(static_cast<std::size_t>(num_packed));
}

template <class Real>
CellMatrix CellMatrices<Real>::get(std::size_t cell) const {
  const std::size_t batch = mesh_->batch_of(cell);
  if (const Real* one = alike(batch)) return Eigen::Map<const Matrix>(one).template cast<double>();
  return packed(batch).get(cell - mesh_->batches()[batch].first);
}

template <class Real>
void CellMatrices<Real>::add_product(const Vector& x, Vector& y) const {
  mesh_->for_each_batch([&](std::size_t b) {
    if (const Real* one = alike(b))
      add_alike_product(one, nodes_of_batch(*mesh_, b), x.data(), y.data());
    else
      add_symmetric_product(packed(b), nodes_of_batch(*mesh_, b), x.data(), y.data());
  });
}

template <class Real>
std::size_t CellMatrices<Real>::bytes() const {
  return bytes_of(shared_) + bytes_of(place_of_batch_) + bytes_of(number_of_alike_) + bytes_of(alike_) +
         bytes_of(packed_);
}

template class CellMatrices<float>;
template class CellMatrices<double>;

}  // namespace hexsolver
