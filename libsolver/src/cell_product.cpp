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

using Nodes = double[3][8];

/// m_ij = sum_a p_ia q_ja
[[gnu::always_inline]] inline void correlate(const Nodes& p, const Nodes& q, double (&m)[3][3]) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      double part[8];
      for (int a = 0; a < 8; ++a) part[a] = p[i][a] * q[j][a];
      m[i][j] = ((part[0] + part[4]) + (part[1] + part[5])) + ((part[2] + part[6]) + (part[3] + part[7]));
    }
}

/// sum_a p_a x q_a of the m above
[[gnu::always_inline]] inline void axial(const double (&m)[3][3], double (&out)[3]) {
  out[0] = m[1][2] - m[2][1];
  out[1] = m[2][0] - m[0][2];
  out[2] = m[0][1] - m[1][0];
}

/// p_a += s (w x q_a)
[[gnu::always_inline]] inline void add_cross(double s, const double (&w)[3], const Nodes& q, Nodes& p) {
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    for (int a = 0; a < 8; ++a) p[i][a] += s * (w[j] * q[k][a] - w[k] * q[j][a]);
  }
}

[[gnu::always_inline]] inline void multiply3(const std::array<double, 9>& m, const double (&x)[3], double (&y)[3]) {
  for (int i = 0; i < 3; ++i) y[i] = m[i] * x[0] + m[i + 3] * x[1] + m[i + 6] * x[2];
}

}  // namespace

HEXSOLVER_CLONES void multiply_turned(const double* k, const double* gradient, const TurnedCell& cell, bool stressed,
                                      const double* x, double* out) {
  Nodes g, y, v, u;
  for (int i = 0; i < 3; ++i)
    for (int a = 0; a < 8; ++a) {
      g[i][a] = gradient[8 * i + a];
      y[i][a] = cell.y[static_cast<std::size_t>(8 * i + a)];
      u[i][a] = x[3 * a + i];
    }
  const auto& r = cell.r;
  for (int i = 0; i < 3; ++i)
    for (int a = 0; a < 8; ++a) v[i][a] = r[3 * i] * u[0][a] + r[3 * i + 1] * u[1][a] + r[3 * i + 2] * u[2][a];

  double gv[3][3], turn[3], w[3];
  correlate(g, v, gv);
  axial(gv, turn);
  multiply3(cell.inverse_m, turn, w);
  for (int i = 0; i < 3; ++i)
    for (int a = 0; a < 8; ++a) u[i][a] = v[i][a];
  add_cross(-1, w, y, u);

  double flat[24], of_flat[24];
  for (int i = 0; i < 3; ++i)
    for (int a = 0; a < 8; ++a) flat[3 * a + i] = u[i][a];
  multiply(k, flat, of_flat);
  for (int i = 0; i < 3; ++i)
    for (int a = 0; a < 8; ++a) u[i][a] = of_flat[3 * a + i];

  double yu[3][3], torque[3], minus[3], dh[3];
  correlate(y, u, yu);
  axial(yu, minus);
  for (int i = 0; i < 3; ++i) torque[i] = -minus[i];
  if (stressed) {
    Nodes f;
    for (int i = 0; i < 3; ++i)
      for (int a = 0; a < 8; ++a) f[i][a] = cell.f[static_cast<std::size_t>(8 * i + a)];
    double fv[3][3], l[3], aw[3];
    correlate(f, v, fv);
    axial(fv, l);
    multiply3(cell.a, w, aw);
    const auto& h = cell.h;
    const double trace = gv[0][0] + gv[1][1] + gv[2][2], hw = h[0] * w[0] + h[1] * w[1] + h[2] * w[2];
    for (int i = 0; i < 3; ++i)
      torque[i] += l[i] + aw[i] + h[i] * trace - (gv[i][0] * h[0] + gv[i][1] * h[1] + gv[i][2] * h[2]);
    double gw[8];
    for (int a = 0; a < 8; ++a) gw[a] = g[0][a] * w[0] + g[1][a] * w[1] + g[2][a] * w[2];
    for (int i = 0; i < 3; ++i)
      for (int a = 0; a < 8; ++a) u[i][a] += g[i][a] * hw - h[i] * gw[a];
    add_cross(1, w, f, u);
  }
  multiply3(cell.inverse_m, torque, dh);
  add_cross(1, dh, g, u);
  for (int i = 0; i < 3; ++i)
    for (int a = 0; a < 8; ++a) v[i][a] = r[i] * u[0][a] + r[i + 3] * u[1][a] + r[i + 6] * u[2][a];
  for (int i = 0; i < 3; ++i)
    for (int a = 0; a < 8; ++a) out[3 * a + i] = v[i][a];
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
