// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

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

/// A vector (24) of each cell of a batch, as vectors of nodes of cells in a row stand: those of node 0 of all cells, of
/// node 1, ...
template <class Real>
struct alignas(8 * sizeof(Real)) LaneVectors {
  static constexpr std::size_t lanes = 8;
  std::array<std::array<Real, 3 * lanes>, 8> of_node{};

  void set(std::size_t lane, const CellVector& v) {
    for (std::size_t a = 0; a < 8; ++a)
      for (std::size_t i = 0; i < 3; ++i)
        of_node[a][3 * lane + i] = static_cast<Real>(v[static_cast<Eigen::Index>(3 * a + i)]);
  }
  /// Shape (3, 8): columns = nodes of the cell.
  auto get(std::size_t lane) const {
    using Stride = Eigen::OuterStride<3 * lanes>;
    return Eigen::Map<const Eigen::Matrix<Real, 3, 8>, Eigen::Unaligned, Stride>(of_node[0].data() + 3 * lane);
  }
};

/// Eight places in a row, for cells or for nothing, and what of a matrix between cells that share a node belongs to
/// them.
struct PlaceSegment {
  static constexpr std::size_t lanes = 8;
  std::int32_t place = 0;  ///< the first
  bool alike = false;      ///< all eight have the same entries
  std::size_t values = 0;  ///< where the entries begin, shape (27, 8), or (27) where they are alike
};

/// One step of an iteration for pressures.
template <class Real>
struct PressureStep {
  Real of_gained, keep, add;
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

/// out = v . x of each cell of a batch, shape (8), aligned as a register
void dot_with_cells(const LaneVectors<double>& v, const BatchNodes& nodes, const double* x, double* out);
void dot_with_cells(const LaneVectors<float>& v, const BatchNodes& nodes, const float* x, float* out);

/// y += p v of each cell of a batch, p of shape (8), aligned as a register
void add_multiples_of_cells(const LaneVectors<double>& v, const double* p, const BatchNodes& nodes, double* y);
void add_multiples_of_cells(const LaneVectors<float>& v, const float* p, const BatchNodes& nodes, float* y);

/// next <- p + keep (p - next) - add (p + of_gained gained + S p) at the places of segments, S with `values`.
/// @param rows  shape (9): from a place, where the rows of three around it begin
void step_pressures(std::span<const PlaceSegment> segments, const std::ptrdiff_t* rows, const double* values,
                    const PressureStep<double>& step, const double* gained, const double* p, double* next);
void step_pressures(std::span<const PlaceSegment> segments, const std::ptrdiff_t* rows, const float* values,
                    const PressureStep<float>& step, const float* gained, const float* p, float* next);

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
