// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

namespace hexsolver {

/// Orthonormal directions of some numbers each, filled up with zeros to whole registers of every machine.
template <class Real>
struct Span {
  static constexpr std::size_t at_once = 4;  ///< directions of a step
  std::size_t rows = 0, count = 0;           ///< of a direction; directions
  std::vector<Real> values;                  ///< shape (rows, count), the first index fastest

  /// @param directions  columns, an Eigen matrix
  template <class Matrix>
  void set(const Matrix& directions) {
    constexpr std::size_t whole_rows = 16;
    const auto up = [](std::ptrdiff_t n, std::size_t to) { return (static_cast<std::size_t>(n) + to - 1) / to * to; };
    rows = up(directions.rows(), whole_rows);
    count = up(directions.cols(), at_once);
    values.assign(rows * count, 0);
    for (std::ptrdiff_t column = 0; column < directions.cols(); ++column)
      for (std::ptrdiff_t row = 0; row < directions.rows(); ++row)
        values[static_cast<std::size_t>(column) * rows + static_cast<std::size_t>(row)] =
            static_cast<Real>(directions(row, column));
  }
};

/// part = D D^T v, D the directions. Each is read once for all columns.
/// @param columns  of v, 1 to 3
/// @param v, part  shape (span.rows, columns), the first index fastest
void part_in_span(const Span<double>& span, int columns, const double* v, double* part);
void part_in_span(const Span<float>& span, int columns, const float* v, float* part);

}  // namespace hexsolver
