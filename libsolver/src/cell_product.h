// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexsolver/mesh.h"

namespace hexsolver {

/// y = K x, K (24, 24) symmetric, x and y of length 24; for the widest vectors of the machine it runs on.
void multiply24(const double* k, const double* x, double* y);
void multiply24(const float* k, const float* x, float* y);

template <class Real>
struct TurnedCells;
struct PositiveParts;

/// The models of the lanes of a batch.
template <class Real>
struct LaneModels {
  static constexpr int lanes = 8;
  const Real* stiffness[lanes];      ///< K, (24, 24) symmetric
  const Real* mean_gradient[lanes];  ///< (8, 3) by columns
  bool alike;                        ///< all are the same
};

/// Where the vectors of the cells of a batch are among those of all nodes.
struct BatchNodes {
  const CellNodes* cells;
  int count;
  const std::int32_t* rows;  ///< Mesh::Batch::rows; null unless they are eight in a row
};

inline BatchNodes nodes_of_batch(const Mesh& mesh, std::size_t number) {
  const Mesh::Batch& batch = mesh.batches()[number];
  return {&mesh.cell_nodes()[batch.first], static_cast<int>(batch.count), batch.is_row ? batch.rows.data() : nullptr};
}

/// y += R (Q^T K Q + E) R^T x of the cells of a batch; E, what the stress adds, only if `stressed`.
/// @param positive  added to that: Z Z^T x; may be null
/// @param x         shape (num_nodes, 3), and y
void add_turned_product(const LaneModels<double>& models, const TurnedCells<double>& cells, bool stressed,
                        const PositiveParts* positive, const BatchNodes& nodes, const double* x, double* y);
void add_turned_product(const LaneModels<float>& models, const TurnedCells<float>& cells, bool stressed,
                        const PositiveParts* positive, const BatchNodes& nodes, const float* x, float* y);

/// y += K x of the cells of a batch, all alike.
void add_alike_product(const double* k, const BatchNodes& nodes, const double* x, double* y);
void add_alike_product(const float* k, const BatchNodes& nodes, const float* x, float* y);

/// The forces R (f - h x g) of each lane on its nodes.
/// @param out  shape (24, 8) as above
void forces_of_turned(const LaneModels<double>& models, const TurnedCells<double>& cells, double* out);

/// H += R (K + T^T B + B^T T) R^T, node by node. K and H (24, 24) symmetric.
/// @param t, b  shape (3, 24), stored by rows
/// @param r     (3, 3) stored by columns
void add_turned_hessian(const double* k, const double* t, const double* b, const double* r, double* h);

/// K <- L^T K L, K (24, 24) symmetric, L the trilinear interpolation from the nodes of a parent to those of its child
/// in a slot.
/// @param factor  children along each axis, 1 or 2
void interpolate_from_parent(int slot, const Index3& factor, double* k);

/// K += sum_r a_r b_r^T, K (24, 24) stored by columns, a_r and b_r the rows of arrays of shape (9, 24), stored by rows.
void add_products24(const double* a, const double* b, double* k);

}  // namespace hexsolver
