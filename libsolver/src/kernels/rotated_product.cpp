// SPDX-License-Identifier: Apache-2.0
#include "kernels/choose_registers.h"
#include "kernels/gather.h"
#include "kernels/rotated_lanes.h"

namespace hexsolver {
namespace {

/// What the stress adds with all of E: torque += A w + L v, b = w.
template <int width, class Real, class L>
[[gnu::always_inline]] inline void add_stress(const RotatedCells<Real>& cells, int first, const L* w, const L* lv,
                                              L* torque, L* b) {
  L aw[3];
  multiply_symmetric3(view<width>(cells.a, first), w, &aw[0]);
  for (int i = 0; i < 3; ++i) {
    torque[i] += aw[i] + lv[i];
    b[i] = w[i];
  }
}

/// What the stress adds with the positive part of E: torque += B t, b = C t with t = B^T w + C^T L v.
template <int width, class L>
[[gnu::always_inline]] inline void add_positive_part(const PositiveParts& positive, int first, const L* w, const L* lv,
                                                     L* torque, L* b) {
  const auto of_t = view<width>(positive.b, first), of_l = view<width>(positive.c, first);
  L t[3];
  for (int i = 0; i < 3; ++i) {
    t[i] = L{};
    for (int j = 0; j < 3; ++j)
      t[i] += __builtin_convertvector(of_t[3 * i + j], L) * w[j] + __builtin_convertvector(of_l[3 * i + j], L) * lv[j];
  }
  for (int i = 0; i < 3; ++i) {
    b[i] = L{};
    for (int j = 0; j < 3; ++j) {
      torque[i] += __builtin_convertvector(of_t[i + 3 * j], L) * t[j];
      b[i] += __builtin_convertvector(of_l[i + 3 * j], L) * t[j];
    }
  }
}

/// x <- R (Q^T K Q + E) R^T x of `width` lanes from `first`. In one piece: taken apart further it was 8 % slower.
template <int width, class Real>
[[gnu::always_inline]] inline void multiply_lanes(const LaneModels<Real>& models, const RotatedCells<Real>& cells,
                                                  bool stressed, const PositiveParts* positive, Real* x_and_out,
                                                  int first) {
  using L = Lanes<Real, width>;
  const LaneView<width, Real> x{x_and_out + first};
  const auto y = view<width>(cells.y, first), f = view<width>(cells.f, first), r = view<width>(cells.r, first),
             inverse_m = view<width>(cells.inverse_m, first), h = view<width>(cells.h, first);
  L g[24], v[24], q[24], u[24], w[3];  // v = R^T x, w = T v, q = Q v, u = K q
  spread_gradients(models, first, g);
  L sum[3] = {};
  for (int a = 0; a < 24; a += 3) {
    for (int i = 0; i < 3; ++i) v[a + i] = r[3 * i] * x[a] + r[3 * i + 1] * x[a + 1] + r[3 * i + 2] * x[a + 2];
    add_cross(g + a, v + a, sum);
  }
  multiply_symmetric3(inverse_m, sum, &w[0]);
  for (int a = 0; a < 24; a += 3) {
    for (int i = 0; i < 3; ++i) q[a + i] = v[a + i];
    add_cross(y + a, w, q + a);  // - w x y
  }
  multiply_each(models, first, q, u);

  // Q^T u = u - T^T sum y_a x u_a, and the stress term T^T (A w + L v) + L^T w, or its positive part.
  L torque[3] = {}, dh[3];
  for (int a = 0; a < 24; a += 3) add_cross(u + a, y + a, torque);
  if (stressed || positive) {
    L lv[3] = {}, gv = {}, b[3];
    for (int a = 0; a < 24; a += 3) {
      L hv;
      dot3(h, v + a, hv);
      add_cross(f + a, v + a, lv);
      for (int i = 0; i < 3; ++i) {
        gv += g[a + i] * v[a + i];
        lv[i] -= g[a + i] * hv;
      }
    }
    for (int i = 0; i < 3; ++i) lv[i] += h[i] * gv;
    if (positive)
      add_positive_part<width>(*positive, first, w, lv, torque, b);
    else
      add_stress<width>(cells, first, w, lv, torque, b);
    L hb;
    dot3(h, b, hb);
    for (int a = 0; a < 24; a += 3) {
      L gb;
      dot3(g + a, b, gb);
      add_cross(b, f + a, u + a);
      for (int i = 0; i < 3; ++i) u[a + i] += g[a + i] * hb - h[i] * gb;
    }
  }
  multiply_symmetric3(inverse_m, torque, &dh[0]);
  for (int a = 0; a < 24; a += 3) {
    add_cross(dh, g + a, u + a);
    multiply3(r, u + a, x + a);
  }
}

template <class Real>
struct RotatedProduct {
  using Number = Real;
  template <int width>
  [[gnu::always_inline]] static void run(const LaneModels<Real>& models, const RotatedCells<Real>& cells, bool stressed,
                                         const PositiveParts* positive, const BatchNodes& nodes, const Real* x,
                                         Real* y) {
    alignas(64) Real values[24 * lanes];
    gather<width>(nodes, x, values);
    for (int first = 0; first < lanes; first += width)
      multiply_lanes<width>(models, cells, stressed, positive, values, first);
    scatter_add<width>(nodes, values, y);
  }
};

const auto in_doubles = for_longest_registers<RotatedProduct<double>>();
const auto in_floats = for_longest_registers<RotatedProduct<float>>();

}  // namespace

void add_rotated_product(const LaneModels<double>& models, const RotatedCells<double>& cells, bool stressed,
                         const PositiveParts* positive, const BatchNodes& nodes, const double* x, double* y) {
  in_doubles(models, cells, stressed, positive, nodes, x, y);
}

void add_rotated_product(const LaneModels<float>& models, const RotatedCells<float>& cells, bool stressed,
                         const PositiveParts* positive, const BatchNodes& nodes, const float* x, float* y) {
  in_floats(models, cells, stressed, positive, nodes, x, y);
}

}  // namespace hexsolver
