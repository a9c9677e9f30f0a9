// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "kernels/batch_nodes.h"

namespace hexsolver {

/// Symmetric matrices (24, 24) of the cells of a batch side by side, packed: the lower triangles.
template <class Real>
struct alignas(8 * sizeof(Real)) SymmetricCells {
  static constexpr std::size_t lanes = Mesh::batch_size;
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

/// y += K x of the cells of a batch, each its own.
void add_symmetric_product(const SymmetricCells<double>& k, const BatchNodes& nodes, const double* x, double* y);
void add_symmetric_product(const SymmetricCells<float>& k, const BatchNodes& nodes, const float* x, float* y);

}  // namespace hexsolver
