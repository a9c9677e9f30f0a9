// SPDX-License-Identifier: Apache-2.0
#include "kernels/vector_product.h"

#include "kernels/choose_registers.h"
#include "kernels/registers.h"

namespace hexsolver {
namespace {

/// v . x of the cells of a batch
template <class Real>
struct Dot {
  using Number = Real;
  template <int width>
  [[gnu::always_inline]] static void run(const LaneVectors<Real>& v, const BatchNodes& nodes, const Real* x,
                                         Real* out) {
    const std::int32_t* const rows = nodes.row();
    if (!rows) {
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
        const Loose* at = reinterpret_cast<Loose*>(x + 3 * (std::ptrdiff_t{rows[a / 2]} + a % 2 + first));
        const L* of_node = reinterpret_cast<const L*>(v.of_node[a].data() + 3 * first);
        for (int part = 0; part < 3; ++part) products[part] += of_node[part] * at[part];
      }
      Shuffles<width>::template apart<0>(products, of_axis[0], Each{});
      Shuffles<width>::template apart<1>(products, of_axis[1], Each{});
      Shuffles<width>::template apart<2>(products, of_axis[2], Each{});
      *reinterpret_cast<L*>(out + first) = of_axis[0] + of_axis[1] + of_axis[2];
    }
  }
};

template <class Real>
struct AddMultiples {
  using Number = Real;
  template <int width>
  [[gnu::always_inline]] static void run(const LaneVectors<Real>& v, const Real* p, const BatchNodes& nodes, Real* y) {
    const std::int32_t* const rows = nodes.row();
    if (!rows) {
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
        Loose* to = reinterpret_cast<Loose*>(y + 3 * (std::ptrdiff_t{rows[a / 2]} + a % 2 + first));
        const L* of_node = reinterpret_cast<const L*>(v.of_node[a].data() + 3 * first);
        for (int part = 0; part < 3; ++part) to[part] += of_node[part] * factors[part];
      }
    }
  }
};

const auto dot_in_doubles = for_longest_registers<Dot<double>>();
const auto dot_in_floats = for_longest_registers<Dot<float>>();
const auto add_multiples_in_doubles = for_longest_registers<AddMultiples<double>>();
const auto add_multiples_in_floats = for_longest_registers<AddMultiples<float>>();

}  // namespace

void dot_with_cells(const LaneVectors<double>& v, const BatchNodes& nodes, const double* x, double* out) {
  dot_in_doubles(v, nodes, x, out);
}

void dot_with_cells(const LaneVectors<float>& v, const BatchNodes& nodes, const float* x, float* out) {
  dot_in_floats(v, nodes, x, out);
}

void add_multiples_of_cells(const LaneVectors<double>& v, const double* p, const BatchNodes& nodes, double* y) {
  add_multiples_in_doubles(v, p, nodes, y);
}

void add_multiples_of_cells(const LaneVectors<float>& v, const float* p, const BatchNodes& nodes, float* y) {
  add_multiples_in_floats(v, p, nodes, y);
}

}  // namespace hexsolver
