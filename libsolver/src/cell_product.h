// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexsolver/mesh.h"

namespace hexsolver {

/// y = K x, K (24, 24) symmetric, x and y of length 24; for the widest vectors of the machine it runs on.
void multiply24(const double* k, const double* x, double* y);

template <class Real>
struct TurnedCells;
struct PositiveParts;

/// Symmetric matrices (24, 24) of the cells of a batch side by side, packed: the lower triangles.
template <class Real>
struct alignas(8 * sizeof(Real)) SymmetricCells {
  static constexpr std::size_t lanes = 8;
  std::array<std::array<Real, lanes>, 300> entries{};

  /// Of an entry, row >= column, in the order in which products take them: strips of six columns, row after row.
  static constexpr std::size_t strip = 6;
  static constexpr std::size_t place(std::size_t row, std::size_t column) {
    const std::size_t left = column / strip * strip, down = row - left, before = left * (49 - left) / 2;
    return before + (down < strip ? down * (down + 1) / 2 : strip * down - strip * (strip - 1) / 2) + column - left;
  }

  void set(std::size_t lane, const CellMatrix& k) {
    for (std::size_t row = 0; row < 24; ++row)
      for (std::size_t column = 0; column <= row; ++column)
        entries[place(row, column)][lane] = static_cast<Real>(k.data()[24 * column + row]);
  }
  CellMatrix get(std::size_t lane) const {
    CellMatrix k;
    for (std::size_t row = 0; row < 24; ++row)
      for (std::size_t column = 0; column <= row; ++column)
        k.data()[24 * column + row] = k.data()[24 * row + column] =
            static_cast<double>(entries[place(row, column)][lane]);
    return k;
  }
};

/// The models of the lanes of a batch.
template <class Real>
struct LaneModels {
  static constexpr int lanes = 8;
  const Real* alike = nullptr;  ///< K of all lanes, (24, 24) symmetric; null where they differ
  // Where they differ, one of these:
  const Real* stiffness[lanes];
  const SymmetricCells<Real>* packed = nullptr;
  const Real* mean_gradient[lanes];  ///< (8, 3) by columns
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
/// @param positive  what takes the place of E; may be null
/// @param x         shape (num_nodes, 3), and y
void add_turned_product(const LaneModels<double>& models, const TurnedCells<double>& cells, bool stressed,
                        const PositiveParts* positive, const BatchNodes& nodes, const double* x, double* y);
void add_turned_product(const LaneModels<float>& models, const TurnedCells<float>& cells, bool stressed,
                        const PositiveParts* positive, const BatchNodes& nodes, const float* x, float* y);

/// y += K x of the cells of a batch, all alike.
void add_alike_product(const double* k, const BatchNodes& nodes, const double* x, double* y);
void add_alike_product(const float* k, const BatchNodes& nodes, const float* x, float* y);

/// y += K x of the cells of a batch, each its own.
void add_symmetric_product(const SymmetricCells<double>& k, const BatchNodes& nodes, const double* x, double* y);
void add_symmetric_product(const SymmetricCells<float>& k, const BatchNodes& nodes, const float* x, float* y);

/// The cells of a batch in their frames, where displaced by u, as TurnedCells says; A only if `stressed`.
/// @param rest  corners relative to the centre of a cell, length 24
/// @param u     shape (num_nodes, 3)
/// @returns bits of the lanes that are too flat or turned inside out for R to be found so: these are of no meaning
unsigned turn_cells(const LaneModels<double>& models, bool stressed, const BatchNodes& nodes, const double* rest,
                    const double* u, TurnedCells<double>& cells);

/// The forces R (f - h x g) of each lane on its nodes.
/// @param out  shape (24, 8) as above
void forces_of_turned(const LaneModels<double>& models, const TurnedCells<double>& cells, double* out);

/// H += R (K + T^T B + B^T T + Z^T Z) R^T, node by node. K and H (24, 24) symmetric.
/// @param t, b, z  shape (3, 24), stored by rows; z may be null
/// @param r        (3, 3) stored by columns
void add_turned_hessian(const double* k, const double* t, const double* b, const double* z, const double* r, double* h);

/// K <- L^T K L, K (24, 24) symmetric, L the trilinear interpolation from the nodes of a parent to those of its child
/// in a slot.
/// @param factor  children along each axis, 1 or 2
void interpolate_from_parent(int slot, const Index3& factor, double* k);

/// K += sum_r a_r b_r^T, K (24, 24) stored by columns, a_r and b_r the rows of arrays of shape (9, 24), stored by rows.
void add_products24(const double* a, const double* b, double* k);

}  // namespace hexsolver
