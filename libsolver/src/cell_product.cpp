// SPDX-License-Identifier: Apache-2.0
#include "cell_product.h"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "hexsolver/elastic.h"
#include "hexsolver/rotation.h"

// Clones are chosen when the program is loaded; sanitizers run before that can happen.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define HEXSOLVER_CHOOSES
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

/// The same number of `width` cells side by side, in a register of the machine: one that is longer would be kept in
/// memory.
template <class Real, int width>
struct LanesOf {
  // NOLINTBEGIN(modernize-use-using)
  typedef Real Type __attribute__((vector_size(width * sizeof(Real)), may_alias));
  typedef Real Loose
      __attribute__((vector_size(width * sizeof(Real)), aligned(alignof(Real)), may_alias));  ///< anywhere
  // NOLINTEND(modernize-use-using)
};
template <class Real, int width>
using Lanes = typename LanesOf<Real, width>::Type;

constexpr int lanes = 8;  // of a batch

/// The numbers of some lanes of a batch, one after the other.
template <int width, class Real>
struct LaneView {
  Real* first;
  auto& operator[](int n) const {
    if constexpr (std::is_const_v<Real>)
      return *reinterpret_cast<const Lanes<std::remove_const_t<Real>, width>*>(first + lanes * n);
    else
      return *reinterpret_cast<Lanes<Real, width>*>(first + lanes * n);
  }
  LaneView operator+(int n) const { return {first + lanes * n}; }
};

template <int width, class Real, std::size_t n>
LaneView<width, const Real> view(const std::array<std::array<Real, lanes>, n>& values, int first) {
  return {values[0].data() + first};
}

template <int width, class Real, std::size_t n>
[[gnu::always_inline]] inline void put(const Lanes<Real, width>* from, std::array<std::array<Real, lanes>, n>& values,
                                       int first) {
  const LaneView<width, Real> to{values[0].data() + first};
  for (std::size_t i = 0; i < n; ++i) to[static_cast<int>(i)] = from[i];
}

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

/// sum += p x q
template <class P, class Q, class L>
[[gnu::always_inline]] inline void add_cross(const P& p, const Q& q, L* sum) {
  sum[0] += p[1] * q[2] - p[2] * q[1];
  sum[1] += p[2] * q[0] - p[0] * q[2];
  sum[2] += p[0] * q[1] - p[1] * q[0];
}

/// d = p . q
template <class P, class Q, class L>
[[gnu::always_inline]] inline void dot3(const P& p, const Q& q, L& d) {
  d = p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
}

/// Vectors of `width` nodes, (x, y, z) of each, taken apart by axis, or put together again: number n of the 3 `width`
/// is entry n / 3 of axis n % 3. Two shuffles of two registers each.
template <int width>
struct Shuffles {
  static constexpr int any = -1;
  static constexpr int apart_of_two(int lane, int axis) { return 3 * lane + axis < 2 * width ? 3 * lane + axis : any; }
  static constexpr int apart_of_third(int lane, int axis) {
    return 3 * lane + axis < 2 * width ? lane : 3 * lane + axis - width;
  }
  static constexpr int together_of_two(int n) { return n % 3 == 2 ? any : n % 3 * width + n / 3; }
  static constexpr int together_of_third(int n) { return n % 3 == 2 ? width + n / 3 : n % width; }

  template <int axis, class L, int... lane>
  [[gnu::always_inline]] static void apart(const L* from, L& to, std::integer_sequence<int, lane...>) {
    const L two = __builtin_shufflevector(from[0], from[1], apart_of_two(lane, axis)...);
    to = __builtin_shufflevector(two, from[2], apart_of_third(lane, axis)...);
  }
  template <int part, class L, int... lane>
  [[gnu::always_inline]] static void together(const L* from, L& to, std::integer_sequence<int, lane...>) {
    const L two = __builtin_shufflevector(from[0], from[1], together_of_two(part * width + lane)...);
    to = __builtin_shufflevector(two, from[2], together_of_third(part * width + lane)...);
  }
};

/// out = vectors of eight nodes in a row, shape (3, 8)
template <int width, class Real>
[[gnu::always_inline]] inline void take_apart(const Real* nodes, Real* out) {
  using L = Lanes<Real, width>;
  using Loose = typename LanesOf<Real, width>::Loose;
  using Each = std::make_integer_sequence<int, width>;
  for (int first = 0; first < lanes; first += width) {
    const Loose* in = reinterpret_cast<const Loose*>(nodes + 3 * first);
    const L from[3] = {in[0], in[1], in[2]};
    const LaneView<width, Real> to{out + first};
    Shuffles<width>::template apart<0>(from, to[0], Each{});
    Shuffles<width>::template apart<1>(from, to[1], Each{});
    Shuffles<width>::template apart<2>(from, to[2], Each{});
  }
}

/// Vectors of eight nodes in a row += those of shape (3, 8)
template <int width, class Real>
[[gnu::always_inline]] inline void add_together(const Real* values, Real* nodes) {
  using L = Lanes<Real, width>;
  using Loose = typename LanesOf<Real, width>::Loose;
  using Each = std::make_integer_sequence<int, width>;
  for (int first = 0; first < lanes; first += width) {
    const LaneView<width, const Real> of_axis{values + first};
    const L from[3] = {of_axis[0], of_axis[1], of_axis[2]};
    L sum[3];
    Shuffles<width>::template together<0>(from, sum[0], Each{});
    Shuffles<width>::template together<1>(from, sum[1], Each{});
    Shuffles<width>::template together<2>(from, sum[2], Each{});
    Loose* to = reinterpret_cast<Loose*>(nodes + 3 * first);
    for (int part = 0; part < 3; ++part) to[part] += sum[part];
  }
}

/// values = vectors of the nodes of each cell, shape (24, 8)
template <int width, class Real>
[[gnu::always_inline]] inline void gather(const BatchNodes& nodes, const Real* x, Real* values) {
  if (nodes.rows) {
    for (int a = 0; a < 8; ++a)
      take_apart<width>(x + 3 * (std::ptrdiff_t{nodes.rows[a / 2]} + a % 2), values + 3 * lanes * a);
    return;
  }
  for (int lane = 0; lane < lanes; ++lane) {
    const CellNodes& of_cell = nodes.cells[std::min(lane, nodes.count - 1)];  // the last again where there are fewer
    for (std::size_t a = 0; a < 8; ++a)
      for (std::size_t i = 0; i < 3; ++i)
        values[lanes * (3 * a + i) + static_cast<std::size_t>(lane)] = x[3 * static_cast<std::size_t>(of_cell[a]) + i];
  }
}

/// y += these
template <int width, class Real>
[[gnu::always_inline]] inline void scatter_add(const BatchNodes& nodes, const Real* values, Real* y) {
  if (nodes.rows) {
    for (int a = 0; a < 8; ++a)
      add_together<width>(values + 3 * lanes * a, y + 3 * (std::ptrdiff_t{nodes.rows[a / 2]} + a % 2));
    return;
  }
  for (int lane = 0; lane < nodes.count; ++lane)
    for (std::size_t a = 0; a < 8; ++a)
      for (std::size_t i = 0; i < 3; ++i)
        y[3 * static_cast<std::size_t>(nodes.cells[lane][a]) + i] +=
            values[lanes * (3 * a + i) + static_cast<std::size_t>(lane)];
}

/// y = K x, the same K in all lanes
template <class Real, class X, class Y>
[[gnu::always_inline]] inline void multiply_alike(const Real* k, const X& x, const Y& y) {
  constexpr int rows = 12;  // whose sums stay in registers
  using L = std::remove_cvref_t<decltype(x[0])>;
  for (int top = 0; top < 24; top += rows) {
    L sum[rows] = {};
    for (int column = 0; column < 24; ++column) {
      const L v = x[column];
      for (int row = 0; row < rows; ++row) sum[row] += k[24 * column + top + row] * v;
    }
    for (int row = 0; row < rows; ++row) y[top + row] = sum[row];
  }
}

/// y = K x, K that of each lane, packed
template <class L, class K, class X, class Y>
[[gnu::always_inline]] inline void multiply_symmetric(const K& k, const X& x, const Y& y) {
  using Packed = SymmetricCells<float>;   // or of doubles: places are the same
  constexpr int columns = Packed::strip;  // whose entries of x and y stay in registers
  constexpr auto place = [](int row, int column) {
    return static_cast<int>(Packed::place(static_cast<std::size_t>(row), static_cast<std::size_t>(column)));
  };
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

/// y = K x, K that of each lane from `first`
template <class Real, class L>
[[gnu::always_inline]] inline void multiply_each(const LaneModels<Real>& models, int first, const L* x, L* y) {
  if (models.alike) return multiply_alike(models.alike, x, y);
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
      if (models.alike)
        to = models.mean_gradient[0][a + 8 * i] - L{};
      else
        for (int lane = 0; lane < width; ++lane) to[lane] = models.mean_gradient[first + lane][a + 8 * i];
    }
}

/// x <- R (Q^T K Q + E) R^T x of `width` lanes from `first`.
template <int width, class Real>
[[gnu::always_inline]] inline void multiply_lanes(const LaneModels<Real>& models, const TurnedCells<Real>& cells,
                                                  bool stressed, const PositiveParts* positive, Real* x_and_out,
                                                  int first) {
  using L = Lanes<Real, width>;
  const LaneView<width, Real> x{x_and_out + first};
  const auto y = view<width>(cells.y, first), f = view<width>(cells.f, first), r = view<width>(cells.r, first),
             inverse_m = view<width>(cells.inverse_m, first), h = view<width>(cells.h, first);
  L g[24], v[24], q[24], u[24];  // v = R^T x, q = Q v, u = K q
  spread_gradients(models, first, g);
  L turn[3] = {}, w[3];
  for (int a = 0; a < 24; a += 3) {
    for (int i = 0; i < 3; ++i) v[a + i] = r[3 * i] * x[a] + r[3 * i + 1] * x[a + 1] + r[3 * i + 2] * x[a + 2];
    add_cross(g + a, v + a, turn);
  }
  multiply_symmetric3(inverse_m, turn, &w[0]);
  for (int a = 0; a < 24; a += 3) {
    for (int i = 0; i < 3; ++i) q[a + i] = v[a + i];
    add_cross(y + a, w, q + a);  // - w x y
  }
  multiply_each(models, first, q, u);

  // Q^T K Q v = K dy - T^T sum y_a x (K dy)_a, and the stress term T^T (A w + L v) + L^T w or, clamped,
  // T^T B t + L^T C t with t = B^T w + C^T L v.
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
    if (positive) {
      const auto of_t = view<width>(positive->b, first), of_l = view<width>(positive->c, first);
      L t[3];
      for (int i = 0; i < 3; ++i) {
        t[i] = L{};
        for (int j = 0; j < 3; ++j)
          t[i] +=
              __builtin_convertvector(of_t[3 * i + j], L) * w[j] + __builtin_convertvector(of_l[3 * i + j], L) * lv[j];
      }
      for (int i = 0; i < 3; ++i) {
        b[i] = L{};
        for (int j = 0; j < 3; ++j) {
          torque[i] += __builtin_convertvector(of_t[i + 3 * j], L) * t[j];
          b[i] += __builtin_convertvector(of_l[i + 3 * j], L) * t[j];
        }
      }
    } else {
      L aw[3];
      multiply_symmetric3(view<width>(cells.a, first), w, &aw[0]);
      for (int i = 0; i < 3; ++i) {
        torque[i] += aw[i] + lv[i];
        b[i] = w[i];
      }
    }
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

template <int width, class Real>
[[gnu::always_inline]] inline void add_turned(const LaneModels<Real>& models, const TurnedCells<Real>& cells,
                                              bool stressed, const PositiveParts* positive, const BatchNodes& nodes,
                                              const Real* x, Real* y) {
  alignas(64) Real values[24 * lanes];
  gather<width>(nodes, x, values);
  for (int first = 0; first < lanes; first += width)
    multiply_lanes<width>(models, cells, stressed, positive, values, first);
  scatter_add<width>(nodes, values, y);
}

/// polar(F) = R S of each lane, matrices by columns, of S and M^-1 the upper triangles by rows.
/// Source: Higham, SIAM J. Sci. Stat. Comput. 7 (1986): R <- (R + R^-T) / 2.
/// @param f  1 is put in the place of what is too flat or inside out
/// @returns bits of these lanes
template <class L>
[[gnu::always_inline]] inline unsigned polar_of_lanes(L* f, L* r, L* s, L* inverse_m) {
  constexpr int width = sizeof(L) / sizeof(double), most_iterations = 20;
  const auto cofactor = [](const L* m, L* c) __attribute__((always_inline)) {
    for (int j = 0; j < 3; ++j) {
      const L *p = m + 3 * ((j + 1) % 3), *q = m + 3 * ((j + 2) % 3);
      for (int i = 0; i < 3; ++i) c[3 * j + i] = L{};
      add_cross(p, q, c + 3 * j);
    }
  };
  L c[9], det, scale = {};
  cofactor(f, c);
  dot3(f, c, det);
  for (int i = 0; i < 9; ++i) scale += f[i] * f[i];
  scale /= 3;
  unsigned left_out = 0;
  for (int lane = 0; lane < width; ++lane)
    if (!(det[lane] > polar_least_jacobian * scale[lane] * std::sqrt(scale[lane]) && scale[lane] > polar_least_scale))
      left_out |= 1U << lane;
  for (int i = 0; i < 9; ++i) {
    for (int lane = 0; lane < width; ++lane)
      if (left_out >> lane & 1U) f[i][lane] = i % 4 == 0;
    r[i] = f[i];
  }
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

  L product[9];  // R^T F
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) dot3(r + 3 * i, f + 3 * j, product[3 * j + i]);
  int n = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j) s[n++] = 0.5 * (product[3 * j + i] + product[3 * i + j]);
  const L m[6] = {s[3] + s[5], -s[1], -s[2], s[0] + s[5], -s[4], s[0] + s[3]};
  inverse_m[0] = m[3] * m[5] - m[4] * m[4];
  inverse_m[1] = m[2] * m[4] - m[1] * m[5];
  inverse_m[2] = m[1] * m[4] - m[2] * m[3];
  inverse_m[3] = m[0] * m[5] - m[2] * m[2];
  inverse_m[4] = m[1] * m[2] - m[0] * m[4];
  inverse_m[5] = m[0] * m[3] - m[1] * m[1];
  const L det_m = m[0] * inverse_m[0] + m[1] * inverse_m[1] + m[2] * inverse_m[2];
  L squares = {};
  for (n = 0; n < 6; ++n) {
    inverse_m[n] /= det_m;
    squares += (n == 0 || n == 3 || n == 5 ? 1.0 : 2.0) * inverse_m[n] * inverse_m[n];
  }
  for (int lane = 0; lane < width; ++lane)
    if (!(squares[lane] * polar_floor * polar_floor <= 1)) left_out |= 1U << lane;
  return left_out;
}

template <int width>
[[gnu::always_inline]] inline unsigned turn_lanes(const LaneModels<double>& models, bool stressed,
                                                  const BatchNodes& nodes, const double* rest, const double* u,
                                                  TurnedCells<double>& cells) {
  using L = Lanes<double, width>;
  alignas(64) double values[24 * lanes];
  gather<width>(nodes, u, values);
  unsigned left_out = 0;
  for (int first = 0; first < lanes; first += width) {
    const LaneView<width, double> moved{values + first};
    L g[24], x[24], d[24], y[24], k_d[24], mean[3] = {}, f[9] = {}, r[9], s[6], inverse_m[6];
    spread_gradients(models, first, g);
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
    left_out |= polar_of_lanes(f, r, s, inverse_m) << first;

    for (int a = 0; a < 24; a += 3)
      for (int i = 0; i < 3; ++i) {
        y[a + i] = r[3 * i] * x[a] + r[3 * i + 1] * x[a + 1] + r[3 * i + 2] * x[a + 2];
        d[a + i] = y[a + i] - rest[a + i];
      }
    multiply_each(models, first, d, k_d);
    L torque[3] = {}, h[3];
    for (int a = 0; a < 24; a += 3) add_cross(y + a, k_d + a, torque);
    multiply_symmetric3(inverse_m, torque, &h[0]);
    L stress[6] = {};  // A
    if (stressed) {
      L yf[9] = {}, hs[9] = {};  // sum of y f^T, [h]x S
      for (int a = 0; a < 24; a += 3)
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) yf[3 * j + i] += y[a + i] * k_d[a + j];
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
    put<width>(y, cells.y, first);
    put<width>(k_d, cells.f, first);
    put<width>(r, cells.r, first);
    put<width>(inverse_m, cells.inverse_m, first);
    put<width>(stress, cells.a, first);
    put<width>(h, cells.h, first);
  }
  return left_out;
}

template <int width, class Real>
[[gnu::always_inline]] inline void add_alike(const Real* k, const BatchNodes& nodes, const Real* x, Real* y) {
  alignas(64) Real values[24 * lanes], sums[24 * lanes];
  gather<width>(nodes, x, values);
  for (int first = 0; first < lanes; first += width) {
    const LaneView<width, Real> of_lanes{values + first}, products{sums + first};
    multiply_alike(k, of_lanes, products);
  }
  scatter_add<width>(nodes, sums, y);
}

template <int width, class Real>
[[gnu::always_inline]] inline void add_symmetric(const SymmetricCells<Real>& k, const BatchNodes& nodes, const Real* x,
                                                 Real* y) {
  alignas(64) Real values[24 * lanes], sums[24 * lanes];
  gather<width>(nodes, x, values);
  for (int first = 0; first < lanes; first += width) {
    const LaneView<width, const Real> of_lanes{values + first};
    const LaneView<width, Real> products{sums + first};
    multiply_symmetric<Lanes<Real, width>>(view<width>(k.entries, first), of_lanes, products);
  }
  scatter_add<width>(nodes, sums, y);
}

/// v . x of the cells of a batch
template <int width, class Real>
[[gnu::always_inline]] inline void dot_vectors(const LaneVectors<Real>& v, const BatchNodes& nodes, const Real* x,
                                               Real* out) {
  if (!nodes.rows) {
    for (int lane = 0; lane < nodes.count; ++lane) {
      Real sum = 0;
      for (std::size_t a = 0; a < 8; ++a)
        for (std::size_t i = 0; i < 3; ++i)
          sum += v.of_node[a][3 * static_cast<std::size_t>(lane) + i] *
                 x[3 * static_cast<std::size_t>(nodes.cells[lane][a]) + i];
      out[lane] = sum;
    }
    return;
  }
  using L = Lanes<Real, width>;
  using Loose = const typename LanesOf<Real, width>::Loose;
  using Each = std::make_integer_sequence<int, width>;
  for (int first = 0; first < lanes; first += width) {
    L products[3] = {}, of_axis[3];
    for (int a = 0; a < 8; ++a) {
      const Loose* at = reinterpret_cast<Loose*>(x + 3 * (std::ptrdiff_t{nodes.rows[a / 2]} + a % 2 + first));
      const L* of_node = reinterpret_cast<const L*>(v.of_node[static_cast<std::size_t>(a)].data() + 3 * first);
      for (int part = 0; part < 3; ++part) products[part] += of_node[part] * at[part];
    }
    Shuffles<width>::template apart<0>(products, of_axis[0], Each{});
    Shuffles<width>::template apart<1>(products, of_axis[1], Each{});
    Shuffles<width>::template apart<2>(products, of_axis[2], Each{});
    *reinterpret_cast<L*>(out + first) = of_axis[0] + of_axis[1] + of_axis[2];
  }
}

template <int width, class Real>
[[gnu::always_inline]] inline void add_multiples(const LaneVectors<Real>& v, const Real* p, const BatchNodes& nodes,
                                                 Real* y) {
  if (!nodes.rows) {
    for (int lane = 0; lane < nodes.count; ++lane)
      for (std::size_t a = 0; a < 8; ++a)
        for (std::size_t i = 0; i < 3; ++i)
          y[3 * static_cast<std::size_t>(nodes.cells[lane][a]) + i] +=
              p[lane] * v.of_node[a][3 * static_cast<std::size_t>(lane) + i];
    return;
  }
  using L = Lanes<Real, width>;
  using Loose = typename LanesOf<Real, width>::Loose;
  using Each = std::make_integer_sequence<int, width>;
  for (int first = 0; first < lanes; first += width) {
    const L of_cells = *reinterpret_cast<const L*>(p + first), of_axis[3] = {of_cells, of_cells, of_cells};
    L factors[3];
    Shuffles<width>::template together<0>(of_axis, factors[0], Each{});
    Shuffles<width>::template together<1>(of_axis, factors[1], Each{});
    Shuffles<width>::template together<2>(of_axis, factors[2], Each{});
    for (const int a : {0, 2, 4, 6, 1, 3, 5, 7}) {  // what follows each other is apart in memory
      Loose* to = reinterpret_cast<Loose*>(y + 3 * (std::ptrdiff_t{nodes.rows[a / 2]} + a % 2 + first));
      const L* of_node = reinterpret_cast<const L*>(v.of_node[static_cast<std::size_t>(a)].data() + 3 * first);
      for (int part = 0; part < 3; ++part) to[part] += of_node[part] * factors[part];
    }
  }
}

template <int width, class Real>
[[gnu::always_inline]] inline void step_segments(std::span<const PlaceSegment> segments, const std::ptrdiff_t* rows,
                                                 const Real* values, const PressureStep<Real>& step, const Real* gained,
                                                 const Real* p, Real* next) {
  using L = Lanes<Real, width>;
  using Loose = typename LanesOf<Real, width>::Loose;
  const auto add_row =
      []<bool alike>(std::bool_constant<alike>, const Real* of, const Real* at, L* sum) __attribute__((always_inline)) {
    for (int i = 0; i < 3; ++i) {
      const L x = *reinterpret_cast<const Loose*>(at + i);
      if constexpr (alike)
        sum[i] += of[i] * x;
      else
        sum[i] += *reinterpret_cast<const Loose*>(of + lanes * i) * x;
    }
  };
  for (const PlaceSegment& segment : segments)
    for (int first = 0; first < lanes; first += width) {
      const Real* const at = p + segment.place + first;
      L sum[3] = {};  // that do not wait for each other
      if (segment.alike)
        for (int row = 0; row < 9; ++row)
          add_row(std::true_type{}, values + segment.values + 3 * row, at + rows[row], sum);
      else
        for (int row = 0; row < 9; ++row)
          add_row(std::false_type{}, values + segment.values + first + 3 * lanes * row, at + rows[row], sum);
      const L now = *reinterpret_cast<const Loose*>(at),
              of_gained = step.of_gained * *reinterpret_cast<const Loose*>(gained + segment.place + first);
      Loose& to = *reinterpret_cast<Loose*>(next + segment.place + first);
      to = now + step.keep * (now - to) - step.add * (now + of_gained + (sum[0] + sum[1] + sum[2]));
    }
}

/// The kernels for registers of one length.
template <class Real>
struct Kernels {
  void (*turned)(const LaneModels<Real>&, const TurnedCells<Real>&, bool, const PositiveParts*, const BatchNodes&,
                 const Real*, Real*);
  void (*alike)(const Real*, const BatchNodes&, const Real*, Real*);
  void (*symmetric)(const SymmetricCells<Real>&, const BatchNodes&, const Real*, Real*);
  void (*dot)(const LaneVectors<Real>&, const BatchNodes&, const Real*, Real*);
  void (*multiples)(const LaneVectors<Real>&, const Real*, const BatchNodes&, Real*);
  void (*step)(std::span<const PlaceSegment>, const std::ptrdiff_t*, const Real*, const PressureStep<Real>&,
               const Real*, const Real*, Real*);
};

#define HEXSOLVER_KERNELS(name, target, Real, width)                                                              \
  target void turned_##name(const LaneModels<Real>& models, const TurnedCells<Real>& cells, bool stressed,        \
                            const PositiveParts* positive, const BatchNodes& nodes, const Real* x, Real* y) {     \
    add_turned<width>(models, cells, stressed, positive, nodes, x, y);                                            \
  }                                                                                                               \
  target void alike_##name(const Real* k, const BatchNodes& nodes, const Real* x, Real* y) {                      \
    add_alike<width>(k, nodes, x, y);                                                                             \
  }                                                                                                               \
  target void symmetric_##name(const SymmetricCells<Real>& k, const BatchNodes& nodes, const Real* x, Real* y) {  \
    add_symmetric<width>(k, nodes, x, y);                                                                         \
  }                                                                                                               \
  target void dot_##name(const LaneVectors<Real>& v, const BatchNodes& nodes, const Real* x, Real* out) {         \
    dot_vectors<width>(v, nodes, x, out);                                                                         \
  }                                                                                                               \
  target void multiples_##name(const LaneVectors<Real>& v, const Real* p, const BatchNodes& nodes, Real* y) {     \
    add_multiples<width>(v, p, nodes, y);                                                                         \
  }                                                                                                               \
  target void step_##name(std::span<const PlaceSegment> segments, const std::ptrdiff_t* rows, const Real* values, \
                          const PressureStep<Real>& step, const Real* gained, const Real* p, Real* next) {        \
    step_segments<width>(segments, rows, values, step, gained, p, next);                                          \
  }                                                                                                               \
  constexpr Kernels<Real> name = {turned_##name, alike_##name,     symmetric_##name,                              \
                                  dot_##name,    multiples_##name, step_##name};

HEXSOLVER_KERNELS(doubles_of_16_bytes, , double, 2)
HEXSOLVER_KERNELS(floats_of_16_bytes, , float, 4)
#ifdef HEXSOLVER_CHOOSES
HEXSOLVER_KERNELS(doubles_of_32_bytes, __attribute__((target("arch=x86-64-v3"))), double, 4)
HEXSOLVER_KERNELS(floats_of_32_bytes, __attribute__((target("arch=x86-64-v3"))), float, 8)
HEXSOLVER_KERNELS(doubles_of_64_bytes, __attribute__((target("arch=x86-64-v4"))), double, 8)
#endif
#undef HEXSOLVER_KERNELS

using TurnCells = unsigned (*)(const LaneModels<double>&, bool, const BatchNodes&, const double*, const double*,
                               TurnedCells<double>&);
#define HEXSOLVER_TURN(name, target, width)                                                                          \
  target unsigned name(const LaneModels<double>& models, bool stressed, const BatchNodes& nodes, const double* rest, \
                       const double* u, TurnedCells<double>& cells) {                                                \
    return turn_lanes<width>(models, stressed, nodes, rest, u, cells);                                               \
  }
HEXSOLVER_TURN(turn_in_16_bytes, , 2)
#ifdef HEXSOLVER_CHOOSES
HEXSOLVER_TURN(turn_in_32_bytes, __attribute__((target("arch=x86-64-v3"))), 4)
HEXSOLVER_TURN(turn_in_64_bytes, __attribute__((target("arch=x86-64-v4"))), 8)
#endif
#undef HEXSOLVER_TURN

/// With what is done in double precision only.
struct KernelsForDoubles : Kernels<double> {
  TurnCells turn;
};

KernelsForDoubles kernels_for_doubles() {
#ifdef HEXSOLVER_CHOOSES
  if (__builtin_cpu_supports("x86-64-v4")) return {doubles_of_64_bytes, turn_in_64_bytes};
  if (__builtin_cpu_supports("x86-64-v3")) return {doubles_of_32_bytes, turn_in_32_bytes};
#endif
  return {doubles_of_16_bytes, turn_in_16_bytes};
}

const Kernels<float>& kernels_for_floats() {
#ifdef HEXSOLVER_CHOOSES
  if (__builtin_cpu_supports("x86-64-v3")) return floats_of_32_bytes;
#endif
  return floats_of_16_bytes;
}

const KernelsForDoubles doubles = kernels_for_doubles();
const Kernels<float>& floats = kernels_for_floats();

}  // namespace

void add_turned_product(const LaneModels<double>& models, const TurnedCells<double>& cells, bool stressed,
                        const PositiveParts* positive, const BatchNodes& nodes, const double* x, double* y) {
  doubles.turned(models, cells, stressed, positive, nodes, x, y);
}

void add_turned_product(const LaneModels<float>& models, const TurnedCells<float>& cells, bool stressed,
                        const PositiveParts* positive, const BatchNodes& nodes, const float* x, float* y) {
  floats.turned(models, cells, stressed, positive, nodes, x, y);
}

void add_alike_product(const double* k, const BatchNodes& nodes, const double* x, double* y) {
  doubles.alike(k, nodes, x, y);
}

void add_alike_product(const float* k, const BatchNodes& nodes, const float* x, float* y) {
  floats.alike(k, nodes, x, y);
}

void add_symmetric_product(const SymmetricCells<double>& k, const BatchNodes& nodes, const double* x, double* y) {
  doubles.symmetric(k, nodes, x, y);
}

void add_symmetric_product(const SymmetricCells<float>& k, const BatchNodes& nodes, const float* x, float* y) {
  floats.symmetric(k, nodes, x, y);
}

void dot_with_cells(const LaneVectors<double>& v, const BatchNodes& nodes, const double* x, double* out) {
  doubles.dot(v, nodes, x, out);
}

void dot_with_cells(const LaneVectors<float>& v, const BatchNodes& nodes, const float* x, float* out) {
  floats.dot(v, nodes, x, out);
}

void add_multiples_of_cells(const LaneVectors<double>& v, const double* p, const BatchNodes& nodes, double* y) {
  doubles.multiples(v, p, nodes, y);
}

void add_multiples_of_cells(const LaneVectors<float>& v, const float* p, const BatchNodes& nodes, float* y) {
  floats.multiples(v, p, nodes, y);
}

void step_pressures(std::span<const PlaceSegment> segments, const std::ptrdiff_t* rows, const double* values,
                    const PressureStep<double>& step, const double* gained, const double* p, double* next) {
  doubles.step(segments, rows, values, step, gained, p, next);
}

void step_pressures(std::span<const PlaceSegment> segments, const std::ptrdiff_t* rows, const float* values,
                    const PressureStep<float>& step, const float* gained, const float* p, float* next) {
  floats.step(segments, rows, values, step, gained, p, next);
}

unsigned turn_cells(const LaneModels<double>& models, bool stressed, const BatchNodes& nodes, const double* rest,
                    const double* u, TurnedCells<double>& cells) {
  return doubles.turn(models, stressed, nodes, rest, u, cells);
}

HEXSOLVER_CLONES void forces_of_turned(const LaneModels<double>& models, const TurnedCells<double>& cells,
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

HEXSOLVER_CLONES void multiply24(const double* k, const double* x, double* y) { multiply(k, x, y); }

namespace {

constexpr int size = 24;  // of the matrix of a cell

[[gnu::always_inline]] inline void transpose(const double* __restrict from, double* __restrict to) {
  for (int column = 0; column < size; ++column)
    for (int row = 0; row < size; ++row) to[size * column + row] = from[size * row + column];
}

/// to = from R^T, node by node
[[gnu::always_inline]] inline void turn_columns(const double* __restrict from, const double* __restrict r,
                                                double* __restrict to) {
  for (int a = 0; a < size; a += 3)
    for (int i = 0; i < 3; ++i)
      for (int row = 0; row < size; ++row)
        to[size * (a + i) + row] =
            from[size * a + row] * r[i] + from[size * (a + 1) + row] * r[i + 3] + from[size * (a + 2) + row] * r[i + 6];
}

/// k <- k L. Axis by axis: a child in the lower half has its lower nodes on the parent's and its upper ones half way,
/// and the other way round in the upper half.
[[gnu::always_inline]] inline void interpolate_columns(int slot, const Index3& factor, double* __restrict k) {
  for (int axis = 0; axis < 3; ++axis) {
    if (factor[static_cast<std::size_t>(axis)] == 1) continue;
    const bool upper = hexmesh::corner_bit(slot, axis) != 0;
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

HEXSOLVER_CLONES void add_turned_hessian(const double* __restrict k, const double* __restrict t,
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
  turn_columns(m, r, n);
  transpose(n, m);
  turn_columns(m, r, n);
  for (int i = 0; i < size * size; ++i) h[i] += n[i];
}

HEXSOLVER_CLONES void interpolate_from_parent(int slot, const Index3& factor, double* k) {
  double m[size * size];
  interpolate_columns(slot, factor, k);
  transpose(k, m);
  interpolate_columns(slot, factor, m);
  for (int i = 0; i < size * size; ++i) k[i] = m[i];
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

}  // namespace hexsolver
