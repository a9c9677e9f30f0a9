// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "kernels/batch_nodes.h"

namespace hexsolver {

/// A vector (24) of each cell of a batch, as vectors of nodes of cells in a row stand: those of node 0 of all cells, of
/// node 1, ...
template <class Real>
struct alignas(8 * sizeof(Real)) LaneVectors {
  static constexpr std::size_t lanes = Mesh::batch_size;
  std::array<std::array<Real, 3 * lanes>, 8> of_node{};

  void set(std::size_t lane, const CellVector& v) {
    for (std::size_t a = 0; a < 8; ++a)
      for (std::size_t i = 0; i < 3; ++i) of_node[a][3 * lane + i] = static_cast<Real>(v[3 * a + i]);
  }
  /// Shape (3, 8): columns = nodes of the cell.
  auto get(std::size_t lane) const {
    using Stride = Eigen::OuterStride<3 * lanes>;
    return Eigen::Map<const Eigen::Matrix<Real, 3, 8>, Eigen::Unaligned, Stride>(of_node[0].data() + 3 * lane);
  }
};

/// out = v . x of each cell of a batch, shape (8), aligned as a register
void dot_with_cells(const LaneVectors<double>& v, const BatchNodes& nodes, const double* x, double* out);
void dot_with_cells(const LaneVectors<float>& v, const BatchNodes& nodes, const float* x, float* out);

/// y += p v of each cell of a batch, p of shape (8), aligned as a register
void add_multiples_of_cells(const LaneVectors<double>& v, const double* p, const BatchNodes& nodes, double* y);
void add_multiples_of_cells(const LaneVectors<float>& v, const float* p, const BatchNodes& nodes, float* y);

}  // namespace hexsolver
