// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace hexsolver {

/// Orthonormal directions of some numbers each, filled up with zeros to whole registers of every machine.
template <class Real>
struct Span {
  static constexpr std::size_t at_once = 4;  ///< directions of a step
  std::size_t rows = 0, count = 0;           ///< of a direction; directions
  std::vector<Real> values;                  ///< shape (rows, count), the first index fastest

  /// @param directions  columns
  void set(const Eigen::MatrixXd& directions) {
    constexpr std::size_t whole_rows = 16;
    const auto up = [](Eigen::Index n, std::size_t to) { return (static_cast<std::size_t>(n) + to - 1) / to * to; };
    rows = up(directions.rows(), whole_rows);
    count = up(directions.cols(), at_once);
    values.assign(rows * count, 0);
    using Filled = Eigen::Map<Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>>;
    Filled(values.data(), static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(count))
        .topLeftCorner(directions.rows(), directions.cols()) = directions.cast<Real>();
  }
};

/// part = D D^T v, D the directions. Each is read once for all columns.
/// @param columns  of v, 1 to 3
/// @param v, part  shape (span.rows, columns), the first index fastest
void part_in_span(const Span<double>& span, int columns, const double* v, double* part);
void part_in_span(const Span<float>& span, int columns, const float* v, float* part);

}  // namespace hexsolver
