// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "core/rotation.h"
#include "kernels/choose_registers.h"
#include "kernels/gather.h"
#include "kernels/rotated_lanes.h"

namespace hexsolver {
namespace {

/// Three by three, by columns: the columns of c are the cross products of those of m.
template <class L>
[[gnu::always_inline]] inline void cofactor(const L* m, L* c) {
  for (int j = 0; j < 3; ++j) {
    const L *p = m + 3 * ((j + 1) % 3), *q = m + 3 * ((j + 2) % 3);
    for (int i = 0; i < 3; ++i) c[3 * j + i] = L{};
    add_cross(p, q, c + 3 * j);
  }
}

/// Put 1 in the place of what is too flat or inside out for Higham's iteration.
/// @returns bits of these lanes
template <class L>
[[gnu::always_inline]] inline unsigned leave_out_flat(L* f) {
  constexpr int width = sizeof(L) / sizeof(double);
  L c[9], det, scale = {};
  cofactor(f, c);
  dot3(f, c, det);
  for (int i = 0; i < 9; ++i) scale += f[i] * f[i];
  scale /= 3;
  unsigned left_out = 0;
  for (int lane = 0; lane < width; ++lane)
    if (!(det[lane] > polar_least_jacobian * scale[lane] * std::sqrt(scale[lane]) && scale[lane] > polar_least_scale))
      left_out |= 1U << lane;
  for (int i = 0; i < 9; ++i)
    for (int lane = 0; lane < width; ++lane)
      if (left_out >> lane & 1U) f[i][lane] = i % 4 == 0;
  return left_out;
}

/// r = the rotation in F. Source: Higham, SIAM J. Sci. Stat. Comput. 7 (1986): R <- (R + R^-T) / 2.
template <class L>
[[gnu::always_inline]] inline void find_rotation(const L* f, L* r) {
  constexpr int width = sizeof(L) / sizeof(double), most_iterations = 20;
  for (int i = 0; i < 9; ++i) r[i] = f[i];
  L c[9], det;
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    cofactor(r, c);
    dot3(r, c, det);
    const L half = 0.5 / det;
    L change = {};
    for (int i = 0; i < 9; ++i) {
      const L next = 0.5 * r[i] + half * c[i];
      change += (next - r[i]) * (next - r[i]);
      r[i] = next;
    }
    double largest = 0;
    for (int lane = 0; lane < width; ++lane) largest = std::max(largest, change[lane]);
    if (largest < polar_settled) break;
  }
}

/// M^-1 with M = tr(S) 1 - S, the upper triangles by rows.
/// @returns bits of the lanes where it is too large
template <class L>
[[gnu::always_inline]] inline unsigned invert_m(const L* s, L* inverse_m) {
  constexpr int width = sizeof(L) / sizeof(double);
  const L m[6] = {s[3] + s[5], -s[1], -s[2], s[0] + s[5], -s[4], s[0] + s[3]};
  inverse_m[0] = m[3] * m[5] - m[4] * m[4];
  inverse_m[1] = m[2] * m[4] - m[1] * m[5];
  inverse_m[2] = m[1] * m[4] - m[2] * m[3];
  inverse_m[3] = m[0] * m[5] - m[2] * m[2];
  inverse_m[4] = m[1] * m[2] - m[0] * m[4];
  inverse_m[5] = m[0] * m[3] - m[1] * m[1];
  const L det_m = m[0] * inverse_m[0] + m[1] * inverse_m[1] + m[2] * inverse_m[2];
  L squares = {};
  for (int n = 0; n < 6; ++n) {
    inverse_m[n] /= det_m;
    squares += (n == 0 || n == 3 || n == 5 ? 1.0 : 2.0) * inverse_m[n] * inverse_m[n];
  }
  unsigned left_out = 0;
  for (int lane = 0; lane < width; ++lane)
    if (!(squares[lane] * polar_floor * polar_floor <= 1)) left_out |= 1U << lane;
  return left_out;
}

/// polar(F) = R S of each lane, matrices by columns, of S and M^-1 the upper triangles by rows.
/// @returns bits of the lanes that this does not do for
template <class L>
[[gnu::always_inline]] inline unsigned polar_of_lanes(L* f, L* r, L* s, L* inverse_m) {
  const unsigned flat = leave_out_flat(f);
  find_rotation(f, r);
  L product[9];  // R^T F
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) dot3(r + 3 * i, f + 3 * j, product[3 * j + i]);
  int n = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j) s[n++] = 0.5 * (product[3 * j + i] + product[3 * i + j]);
  return flat | invert_m(s, inverse_m);
}

/// x = corners where displaced, from their mean; F = sum x_a g_a^T.
template <int width, class L>
[[gnu::always_inline]] inline void find_gradient(const double* values, const double* corners, const L* g, L* x, L* f) {
  const LaneView<width, const double> moved{values}, rest{corners};
  L mean[3] = {};
  for (int a = 0; a < 24; a += 3)
    for (int i = 0; i < 3; ++i) {
      x[a + i] = moved[a + i] + rest[a + i];
      mean[i] += x[a + i] / 8;
    }
  for (int a = 0; a < 24; a += 3)
    for (int i = 0; i < 3; ++i) {
      x[a + i] -= mean[i];
      for (int j = 0; j < 3; ++j) f[3 * j + i] += x[a + i] * g[a + j];
    }
}

/// A = sym(sum y_a f_a^T - [h]x S) - tr(sum y_a f_a^T) 1, the upper triangle by rows.
template <class L>
[[gnu::always_inline]] inline void find_stress(const L* y, const L* f, const L* s, const L* h, L* stress) {
  L yf[9] = {}, hs[9] = {};  // sum of y f^T, [h]x S
  for (int a = 0; a < 24; a += 3)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) yf[3 * j + i] += y[a + i] * f[a + j];
  const L columns[9] = {s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5]};
  for (int j = 0; j < 3; ++j) add_cross(h, columns + 3 * j, hs + 3 * j);
  const L trace = yf[0] + yf[4] + yf[8];
  int n = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j, ++n) {
      stress[n] = 0.5 * (yf[3 * j + i] - hs[3 * j + i] + yf[3 * i + j] - hs[3 * i + j]);
      if (i == j) stress[n] -= trace;
    }
}

struct Rotate {
  using Number = double;
  template <int width>
  [[gnu::always_inline]] static unsigned run(const LaneModels<double>& models, bool stressed, const BatchNodes& nodes,
                                             const double* rest, const double* u, RotatedCells<double>& cells) {
    using L = Lanes<double, width>;
    alignas(64) double values[24 * lanes];
    gather<width>(nodes, u, values);
    unsigned left_out = 0;
    for (int first = 0; first < lanes; first += width) {
      L g[24], x[24], d[24], y[24], k_d[24], f[9] = {}, r[9], s[6], inverse_m[6];
      spread_gradients(models, first, g);
      find_gradient<width>(values + first, rest + first, g, x, f);
      left_out |= polar_of_lanes(f, r, s, inverse_m) << first;
      const LaneView<width, const double> at_rest{rest + first};
      for (int a = 0; a < 24; a += 3)
        for (int i = 0; i < 3; ++i) {
          y[a + i] = r[3 * i] * x[a] + r[3 * i + 1] * x[a + 1] + r[3 * i + 2] * x[a + 2];
          d[a + i] = y[a + i] - at_rest[a + i];
        }
      multiply_each(models, first, d, k_d);
      L torque[3] = {}, h[3], stress[6] = {};
      for (int a = 0; a < 24; a += 3) add_cross(y + a, k_d + a, torque);
      multiply_symmetric3(inverse_m, torque, &h[0]);
      if (stressed) find_stress(y, k_d, s, h, stress);
      put<width>(y, cells.y, first);
      put<width>(k_d, cells.f, first);
      put<width>(r, cells.r, first);
      put<width>(inverse_m, cells.inverse_m, first);
      put<width>(stress, cells.a, first);
      put<width>(h, cells.h, first);
    }
    return left_out;
  }
};

const auto rotate_in_registers = for_longest_registers<Rotate>();

}  // namespace

unsigned rotate_cells(const LaneModels<double>& models, bool stressed, const BatchNodes& nodes, const double* rest,
                      const double* u, RotatedCells<double>& cells) {
  return rotate_in_registers(models, stressed, nodes, rest, u, cells);
}

HEXSOLVER_CLONES void forces_of_rotated(const LaneModels<double>& models, const RotatedCells<double>& cells,
                                        double* forces) {
  constexpr int width = 2;  // of the registers of every machine: it is called once a Newton step
  using L = Lanes<double, width>;
  for (int first = 0; first < lanes; first += width) {
    const LaneView<width, double> out{forces + first};
    const auto f = view<width>(cells.f, first), r = view<width>(cells.r, first), h = view<width>(cells.h, first);
    L g[24];
    spread_gradients(models, first, g);
    for (int a = 0; a < 24; a += 3) {
      L force[3];
      for (int i = 0; i < 3; ++i) force[i] = f[a + i];
      add_cross(g + a, h, force);
      multiply3(r, force, out + a);
    }
  }
}

}  // namespace hexsolver
