// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "kernels/multiply_lanes.h"
#include "kernels/rotated_cells.h"

namespace hexsolver {

/// y = m x, the upper triangle of a symmetric m by rows
template <class M, class X, class Y>
[[gnu::always_inline]] inline void multiply_symmetric3(const M& m, const X& x, const Y& y) {
  y[0] = m[0] * x[0] + m[1] * x[1] + m[2] * x[2];
  y[1] = m[1] * x[0] + m[3] * x[1] + m[4] * x[2];
  y[2] = m[2] * x[0] + m[4] * x[1] + m[5] * x[2];
}

/// y = m x, 3x3 by columns
template <class M, class X, class Y>
[[gnu::always_inline]] inline void multiply3(const M& m, const X& x, const Y& y) {
  for (int i = 0; i < 3; ++i) y[i] = m[i] * x[0] + m[i + 3] * x[1] + m[i + 6] * x[2];
}

/// sum += p x q; two fused operations each
template <class P, class Q, class L>
[[gnu::always_inline]] inline void add_cross(const P& p, const Q& q, L* sum) {
  for (int i = 0, j = 1, k = 2; i < 3; j = k, k = i++) {
    sum[i] += p[j] * q[k];
    sum[i] -= p[k] * q[j];
  }
}

/// d = p . q
template <class P, class Q, class L>
[[gnu::always_inline]] inline void dot3(const P& p, const Q& q, L& d) {
  d = p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
}

/// y = K x, K that of each lane from `first`
template <class Real, class L>
[[gnu::always_inline]] inline void multiply_each(const LaneModels<Real>& models, int first, const L* x, L* y) {
  if (models.alike.full) return multiply_alike(models.alike, x, y);
  constexpr int width = sizeof(L) / sizeof(Real);
  if (models.packed) return multiply_symmetric<L>(view<width>(models.packed->entries, first), x, y);
  for (int lane = 0; lane < width; ++lane) {
    Real one[24], product[24];
    for (int n = 0; n < 24; ++n) one[n] = x[n][lane];
    multiply(models.stiffness[first + lane], one, product);
    for (int n = 0; n < 24; ++n) y[n][lane] = product[n];
  }
}

/// The mean gradients of node 0, of node 1, ...
template <class Real, class L>
[[gnu::always_inline]] inline void spread_gradients(const LaneModels<Real>& models, int first, L* g) {
  constexpr int width = sizeof(L) / sizeof(Real);
  for (int a = 0; a < 8; ++a)
    for (int i = 0; i < 3; ++i) {
      L& to = g[3 * a + i];
      if (models.alike.full)
        to = models.mean_gradient[0][a + 8 * i] - L{};
      else
        for (int lane = 0; lane < width; ++lane) to[lane] = models.mean_gradient[first + lane][a + 8 * i];
    }
}

}  // namespace hexsolver
