// SPDX-License-Identifier: Apache-2.0
#include "terms/cauchy.h"

#include <algorithm>

#include "kernels/alike_product.h"
#include "kernels/cell_vectors.h"
#include "terms/single_models.h"

namespace hexsolver {

double CauchyCells::cell_energy(std::size_t cell, const NodeVector& u) const {
  const CellVector v = moved(cell, u);
  return 0.5 * v.dot(times(model(cell).stiffness, v));
}

std::optional<CellVector> CauchyCells::force_on_lattice(std::size_t cell, const CellVector& to_unstressed) const {
  return times(model(cell).stiffness, -to_unstressed);
}

Mat3 CauchyCells::stress(std::size_t cell, const NodeVector& u) const {
  const Mat3 f = mean_elastic_gradient(cell, u);
  return hooke_stress(model(cell), (f + f.transpose()) / 2 - Mat3::Identity());
}

void CauchyCells::add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const {
  mesh_.for_each_cell([&](std::size_t c) {
    const CellVector force = times(model(c).stiffness, moved(c, u));
    mesh_.scatter_add(c, force, gradient);
    mesh_.scatter_add(c, force.cwiseAbs(), magnitude);
  });
}

void CauchyCells::add_product(const NodeVector& x, NodeVector& y) const {
  mesh_.for_each_batch([&](std::size_t b) {
    const Mesh::Batch& batch = mesh_.batches()[b];
    const auto first = elements_.begin() + static_cast<std::ptrdiff_t>(batch.first);
    const auto last = first + static_cast<std::ptrdiff_t>(batch.count);
    if (std::all_of(first, last, [&](std::int32_t e) { return e == *first; })) {
      add_alike_product(model(batch.first).alike(), nodes_of_batch(mesh_, b), x.data(), y.data());
      return;
    }
    for (std::size_t c = batch.first; c < batch.first + batch.count; ++c)
      mesh_.scatter_add(c, times(model(c).stiffness, mesh_.gather(c, x)), y);
  });
}

void CauchyCells::add_product(const FloatNodeVector& x, FloatNodeVector& y) const {
  single_models().stiffness.add_product(x, y);
}

void CauchyCells::add_diagonal(std::size_t cell, NodeBlocks& blocks) const {
  hexsolver::add_diagonal(Mat3::Identity(), model(cell).stiffness, blocks);
}

}  // namespace hexsolver
