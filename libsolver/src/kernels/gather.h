// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "kernels/batch_nodes.h"
#include "kernels/registers.h"

namespace hexsolver {

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

}  // namespace hexsolver
