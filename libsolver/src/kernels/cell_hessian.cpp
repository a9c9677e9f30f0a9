// SPDX-License-Identifier: Apache-2.0
#include "kernels/cell_hessian.h"

#include "kernels/choose_registers.h"
#include "kernels/multiply_lanes.h"

namespace hexsolver {

HEXSOLVER_CLONES void multiply24(const double* k, const double* x, double* y) { multiply(k, x, y); }

HEXSOLVER_CLONES void multiply24_both(const double* __restrict m, const double* __restrict x_a,
                                      const double* __restrict x_b, double* __restrict y_a, double* __restrict y_b) {
  double sum[24] = {};
  for (int column = 0; column < 24; ++column) {
    double products[24], of_column = 0;
    for (int row = 0; row < 24; ++row) {
      sum[row] += m[24 * column + row] * x_b[column];
      products[row] = m[24 * column + row] * x_a[row];
    }
    for (int row = 0; row < 24; ++row) of_column += products[row];
    y_b[column] = of_column;
  }
  for (int row = 0; row < 24; ++row) y_a[row] = sum[row];
}

namespace {

constexpr int size = 24;  // of the matrix of a cell

[[gnu::always_inline]] inline void transpose(const double* __restrict from, double* __restrict to) {
  for (int column = 0; column < size; ++column)
    for (int row = 0; row < size; ++row) to[size * column + row] = from[size * row + column];
}

/// to = from R^T, node by node
[[gnu::always_inline]] inline void rotate_columns(const double* __restrict from, const double* __restrict r,
                                                  double* __restrict to) {
  for (int a = 0; a < size; a += 3)
    for (int i = 0; i < 3; ++i)
      for (int row = 0; row < size; ++row)
        to[size * (a + i) + row] =
            from[size * a + row] * r[i] + from[size * (a + 1) + row] * r[i + 3] + from[size * (a + 2) + row] * r[i + 6];
}

/// k <- k L. Axis by axis: a child in the lower half has its lower nodes on the parent's and its upper ones half way,
/// and the other way round in the upper half.
[[gnu::always_inline]] inline void interpolate_columns(const Slot& slot, double* __restrict k) {
  for (int axis = 0; axis < 3; ++axis) {
    if (slot.factor[axis] == 1) continue;
    const bool upper = hexmesh::corner_bit(slot.number, axis) != 0;
    for (int a = 0; a < 8; ++a) {
      if (hexmesh::corner_bit(a, axis)) continue;
      const int low = 3 * a, high = 3 * (a | 1 << axis);
      double* const whole = k + size * (upper ? high : low);
      double* const half = k + size * (upper ? low : high);
      for (int n = 0; n < 3 * size; ++n) {
        half[n] *= 0.5;
        whole[n] += half[n];
      }
    }
  }
}

}  // namespace

HEXSOLVER_CLONES void add_rotated_hessian(const double* __restrict k, const double* __restrict t,
                                          const double* __restrict b, const double* __restrict z,
                                          const double* __restrict r, double* __restrict h) {
  double m[size * size], n[size * size];
  for (int column = 0; column < size; ++column)
    for (int row = 0; row < size; ++row) {
      double sum = k[size * column + row];
      for (int i = 0; i < 3 * size; i += size) sum += t[i + row] * b[i + column] + b[i + row] * t[i + column];
      m[size * column + row] = sum;
    }
  if (z)
    for (int column = 0; column < size; ++column)
      for (int row = 0; row < size; ++row)
        for (int i = 0; i < 3 * size; i += size) m[size * column + row] += z[i + row] * z[i + column];
  rotate_columns(m, r, n);
  transpose(n, m);
  rotate_columns(m, r, n);
  for (int i = 0; i < size * size; ++i) h[i] += n[i];
}

HEXSOLVER_CLONES void interpolate_from_parent(const Slot& slot, double* k) {
  double m[size * size];
  interpolate_columns(slot, k);
  transpose(k, m);
  interpolate_columns(slot, m);
  for (int i = 0; i < size * size; ++i) k[i] = m[i];
}

HEXSOLVER_CLONES void interpolate_from_parents(const Slot& a, const Slot& b, double* m) {
  double transposed[size * size];
  interpolate_columns(b, m);
  transpose(m, transposed);
  interpolate_columns(a, transposed);
  transpose(transposed, m);
}

HEXSOLVER_CLONES void add_products24(const double* __restrict a, const double* __restrict b, double* __restrict k) {
  for (int column = 0; column < 24; ++column) {
    double sum[24];
    for (int row = 0; row < 24; ++row) sum[row] = k[24 * column + row];
    for (int r = 0; r < 9; ++r) {
      const double v = b[24 * r + column];
      for (int row = 0; row < 24; ++row) sum[row] += a[24 * r + row] * v;
    }
    for (int row = 0; row < 24; ++row) k[24 * column + row] = sum[row];
  }
}

HEXSOLVER_CLONES void add_point_product(const double* __restrict of_a, const double* __restrict of_b,
                                        const double* __restrict a, double* __restrict m) {
  double products[3 * size];  // H_a^T A
  for (int column = 0; column < 3; ++column)
    for (int node = 0; node < 8; ++node)
      for (int row = 0; row < 3; ++row) products[size * column + 3 * node + row] = of_a[node] * a[3 * column + row];
  for (int node = 0; node < 8; ++node)
    for (int n = 0; n < 3 * size; ++n) m[3 * size * node + n] += of_b[node] * products[n];
}

}  // namespace hexsolver
