// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "kernels/mirrored_matrix.h"
#include "kernels/registers.h"
#include "kernels/symmetric_product.h"

namespace hexsolver {

/// y = K x of one cell
template <class Real>
[[gnu::always_inline]] inline void multiply(const Real* __restrict k, const Real* __restrict x, Real* __restrict y) {
  Real sum[24] = {};
  for (int column = 0; column < 24; ++column) {
    const Real v = x[column];
    for (int row = 0; row < 24; ++row) sum[row] += k[24 * column + row] * v;
  }
  for (int row = 0; row < 24; ++row) y[row] = sum[row];
}

/// s_m = sum over the corners of the sign of m there times x, in place; twice is 8 x.
template <class L>
[[gnu::always_inline]] inline void into_products(L* x) {
#pragma GCC unroll 3
  for (int axis = 0; axis < 3; ++axis)
#pragma GCC unroll 12
    for (int pair = 0; pair < 12; ++pair) {
      const int upper = 3 << axis, n = pair / upper * 2 * upper + pair % upper;
      const L low = x[n], high = x[n + upper];
      x[n] = low + high;
      x[n + upper] = low - high;
    }
}

/// y = K x, the same K in all lanes
template <class Real, class X, class Y>
[[gnu::always_inline]] inline void multiply_mirrored(const MirroredMatrix<Real>& k, const X& x, const Y& y) {
  using L = std::remove_cvref_t<decltype(x[0])>;
  L of[24];
#pragma GCC unroll 24
  for (int n = 0; n < 24; ++n) of[n] = x[n];
  into_products(of);
#pragma GCC unroll 8
  for (int p = 0; p < 8; ++p) {
    const Real* const block = k.blocks.data() + 9 * p;
    L& i = of[k.place(p, 0)];
    L& j = of[k.place(p, 1)];
    L& l = of[k.place(p, 2)];
    const L from[3] = {i, j, l};
    i = block[0] * from[0] + block[1] * from[1] + block[2] * from[2];
    j = block[3] * from[0] + block[4] * from[1] + block[5] * from[2];
    l = block[6] * from[0] + block[7] * from[1] + block[8] * from[2];
  }
  into_products(of);
#pragma GCC unroll 24
  for (int n = 0; n < 24; ++n) y[n] = of[n];
}

template <class Real, class X, class Y>
[[gnu::always_inline]] inline void multiply_alike(const AlikeMatrix<Real>& k, const X& x, const Y& y) {
  if (k.mirrored) return multiply_mirrored(*k.mirrored, x, y);
  constexpr int rows = 12;  // whose sums stay in registers
  using L = std::remove_cvref_t<decltype(x[0])>;
  for (int top = 0; top < 24; top += rows) {
    L sum[rows] = {};
    for (int column = 0; column < 24; ++column) {
      const L v = x[column];
      for (int row = 0; row < rows; ++row) sum[row] += k.full[24 * column + top + row] * v;
    }
    for (int row = 0; row < rows; ++row) y[top + row] = sum[row];
  }
}

/// y = K x, K that of each lane, packed
template <class L, class K, class X, class Y>
[[gnu::always_inline]] inline void multiply_symmetric(const K& k, const X& x, const Y& y) {
  using Packed = SymmetricCells<float>;   // or of doubles: places are the same
  constexpr int columns = Packed::strip;  // whose entries of x and y stay in registers
  constexpr auto place = [](int row, int column) { return static_cast<int>(Packed::place(row, column)); };
  for (int n = 0; n < 24; ++n) y[n] = L{};
  for (int left = 0; left < 24; left += columns) {
    L of_x[columns], sum[columns] = {};
    for (int column = 0; column < columns; ++column) of_x[column] = x[left + column];
#pragma GCC unroll 6
    for (int row = 0; row < columns; ++row) {
      const auto of_row = k + place(left + row, left);
#pragma GCC unroll 6
      for (int column = 0; column < row; ++column) {
        sum[row] += of_row[column] * of_x[column];
        sum[column] += of_row[column] * of_x[row];
      }
      sum[row] += of_row[row] * of_x[row];
    }
    for (int row = left + columns; row < 24; ++row) {
      const auto of_row = k + place(row, left);
      const L row_x = x[row];
      L product = y[row];
      for (int column = 0; column < columns; ++column) {
        product += of_row[column] * of_x[column];
        sum[column] += of_row[column] * row_x;
      }
      y[row] = product;
    }
    for (int column = 0; column < columns; ++column) y[left + column] += sum[column];
  }
}

}  // namespace hexsolver
