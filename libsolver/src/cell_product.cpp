// SPDX-License-Identifier: Apache-2.0
#include "cell_product.h"

// Clones are chosen when the program is loaded; sanitizers run before that can happen.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define HEXSOLVER_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define HEXSOLVER_CLONES
#endif

namespace hexsolver {
namespace {

template <class Real>
[[gnu::always_inline]] inline void multiply(const Real* __restrict k, const Real* __restrict x, Real* __restrict y) {
  Real sum[24] = {};
  for (int column = 0; column < 24; ++column) {
    const Real v = x[column];
    for (int row = 0; row < 24; ++row) sum[row] += k[24 * column + row] * v;
  }
  for (int row = 0; row < 24; ++row) y[row] = sum[row];
}

}  // namespace

HEXSOLVER_CLONES void multiply24(const double* k, const double* x, double* y) { multiply(k, x, y); }
HEXSOLVER_CLONES void multiply24(const float* k, const float* x, float* y) { multiply(k, x, y); }

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

}  // namespace hexsolver
