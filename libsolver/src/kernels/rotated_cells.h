// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "kernels/mirrored_matrix.h"
#include "kernels/symmetric_product.h"

namespace hexsolver {

/// Up to eight co-rotational cells at one state, side by side, for products with their Hessians; the letters are those
/// of THEORY.md. R by columns, of the symmetric M^-1 and A the upper triangles by rows; what has a vector for each node
/// holds that of node 0, of node 1, ...
template <class Real>
struct alignas(8 * sizeof(Real)) RotatedCells {
  static constexpr std::size_t lanes = Mesh::batch_size;
  using Lanes = std::array<Real, lanes>;
  std::array<Lanes, 24> y, f;
  std::array<Lanes, 9> r;
  std::array<Lanes, 6> inverse_m, a;
  std::array<Lanes, 3> h;
};

/// What a projected Hessian has in place of E of each of these: Z Z^T with Z = T^T B + L^T C, B and C of shape (3, 3)
/// by columns. It need not be exact.
struct alignas(32) PositiveParts {
  using Lanes = std::array<float, RotatedCells<float>::lanes>;
  std::array<Lanes, 9> b, c;
};

/// The models of the lanes of a batch.
template <class Real>
struct LaneModels {
  static constexpr std::size_t lanes = Mesh::batch_size;
  AlikeMatrix<Real> alike;  ///< K of all lanes; nothing where they differ
  // Where they differ, one of these:
  const Real* stiffness[lanes];
  const SymmetricCells<Real>* packed = nullptr;
  const Real* mean_gradient[lanes];  ///< (8, 3) by columns; of the first for all lanes if they are alike
};

/// y += R (Q^T K Q + E) R^T x of the cells of a batch; E, what the stress adds, only if `stressed`.
/// @param positive  what takes the place of E; may be null
/// @param x         shape (num_nodes, 3), and y
void add_rotated_product(const LaneModels<double>& models, const RotatedCells<double>& cells, bool stressed,
                         const PositiveParts* positive, const BatchNodes& nodes, const double* x, double* y);
void add_rotated_product(const LaneModels<float>& models, const RotatedCells<float>& cells, bool stressed,
                         const PositiveParts* positive, const BatchNodes& nodes, const float* x, float* y);

/// The cells of a batch in their frames, where displaced by u, as RotatedCells says; A only if `stressed`.
/// @param rest  corners at rest relative to any point of each lane's cell, shape (24, 8)
/// @param u     shape (num_nodes, 3)
/// @returns bits of the lanes that are too flat or inverted for R to be found so: these are of no meaning
unsigned rotate_cells(const LaneModels<double>& models, bool stressed, const BatchNodes& nodes, const double* rest,
                      const double* u, RotatedCells<double>& cells);

/// The forces R (f - h x g) of each lane on its nodes.
/// @param out  shape (24, 8) as above
void forces_of_rotated(const LaneModels<double>& models, const RotatedCells<double>& cells, double* out);

}  // namespace hexsolver
