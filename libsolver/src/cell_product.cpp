// SPDX-License-Identifier: Apache-2.0
#include "cell_product.h"

#include "hexsolver/elastic.h"

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

/// The same number of eight cells.
using Lanes = double __attribute__((vector_size(64), may_alias));

inline const Lanes* lanes_of(const TurnedCells::Lanes* values) { return reinterpret_cast<const Lanes*>(values); }

/// y = m x, 3x3 by columns
[[gnu::always_inline]] inline void multiply3(const Lanes* m, const Lanes* x, Lanes* y) {
  for (int i = 0; i < 3; ++i) y[i] = m[i] * x[0] + m[i + 3] * x[1] + m[i + 6] * x[2];
}

/// sum += p x q
[[gnu::always_inline]] inline void add_cross(const Lanes* p, const Lanes* q, Lanes* sum) {
  sum[0] += p[1] * q[2] - p[2] * q[1];
  sum[1] += p[2] * q[0] - p[0] * q[2];
  sum[2] += p[0] * q[1] - p[1] * q[0];
}

/// d = p . q
[[gnu::always_inline]] inline void dot3(const Lanes* p, const Lanes* q, Lanes& d) {
  d = p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
}

/// y = K x with the same K in all lanes
[[gnu::always_inline]] inline void multiply_shared(const double* __restrict k, const Lanes* __restrict x,
                                                   Lanes* __restrict y) {
  constexpr int rows = 6;  // whose sums stay in registers
  for (int first = 0; first < 24; first += rows) {
    Lanes sum[rows] = {};
    for (int column = 0; column < 24; ++column)
      for (int row = 0; row < rows; ++row) sum[row] += k[24 * column + first + row] * x[column];
    for (int row = 0; row < rows; ++row) y[first + row] = sum[row];
  }
}

}  // namespace

HEXSOLVER_CLONES void multiply_turned(const double* const* k, bool shared, const TurnedCells& cells, bool stressed,
                                      double* x_and_out) {
  Lanes* const x = reinterpret_cast<Lanes*>(x_and_out);
  const Lanes *const y = lanes_of(cells.y.data()), *const f = lanes_of(cells.f.data()),
                     *const g = lanes_of(cells.g.data()), *const r = lanes_of(cells.r.data()),
                     *const inverse_m = lanes_of(cells.inverse_m.data()), *const h = lanes_of(cells.h.data());
  Lanes v[24], u[24];  // R^T x; Q R^T x, then K times that
  Lanes turn[3] = {}, w[3];
  for (int a = 0; a < 24; a += 3) {
    for (int i = 0; i < 3; ++i) v[a + i] = r[3 * i] * x[a] + r[3 * i + 1] * x[a + 1] + r[3 * i + 2] * x[a + 2];
    add_cross(g + a, v + a, turn);
  }
  multiply3(inverse_m, turn, w);
  for (int a = 0; a < 24; a += 3) {
    for (int i = 0; i < 3; ++i) u[a + i] = v[a + i];
    add_cross(y + a, w, u + a);  // - w x y
  }
  if (shared) {
    multiply_shared(k[0], u, x);
    for (int n = 0; n < 24; ++n) u[n] = x[n];
  } else {
    for (std::size_t lane = 0; lane < TurnedCells::lanes; ++lane) {
      double one[24], product[24];
      for (int n = 0; n < 24; ++n) one[n] = u[n][lane];
      multiply(k[lane], one, product);
      for (int n = 0; n < 24; ++n) u[n][lane] = product[n];
    }
  }

  // Q^T K Q v = K dy - T^T sum y_a x (K dy)_a, and the stress term T^T (A w + L v) + L^T w.
  Lanes torque[3] = {}, dh[3];
  for (int a = 0; a < 24; a += 3) add_cross(u + a, y + a, torque);
  if (stressed) {
    Lanes aw[3], hw, gv, hv, gw;
    dot3(h, w, hw);
    multiply3(lanes_of(cells.a.data()), w, aw);
    for (int i = 0; i < 3; ++i) torque[i] += aw[i];
    for (int a = 0; a < 24; a += 3) {
      dot3(g + a, v + a, gv);
      dot3(h, v + a, hv);
      dot3(g + a, w, gw);
      add_cross(f + a, v + a, torque);
      add_cross(w, f + a, u + a);
      for (int i = 0; i < 3; ++i) {
        torque[i] += h[i] * gv - g[a + i] * hv;
        u[a + i] += g[a + i] * hw - h[i] * gw;
      }
    }
  }
  multiply3(inverse_m, torque, dh);
  for (int a = 0; a < 24; a += 3) {
    add_cross(dh, g + a, u + a);
    multiply3(r, u + a, x + a);
  }
}

HEXSOLVER_CLONES void forces_of_turned(const TurnedCells& cells, double* forces) {
  Lanes* const out = reinterpret_cast<Lanes*>(forces);
  const Lanes *const f = lanes_of(cells.f.data()), *const g = lanes_of(cells.g.data()),
                     *const r = lanes_of(cells.r.data()), *const h = lanes_of(cells.h.data());
  for (int a = 0; a < 24; a += 3) {
    Lanes force[3];
    for (int i = 0; i < 3; ++i) force[i] = f[a + i];
    add_cross(g + a, h, force);
    multiply3(r, force, out + a);
  }
}

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
