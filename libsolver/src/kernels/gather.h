// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "kernels/batch_nodes.h"
#include "kernels/registers.h"

namespace hexsolver {

/// Nine nodes in a row are those of an edge along the row, of eight cells side by side: the first node's and the second
/// node's values, shape (3, 8) each, are the same but for one lane.
template <int width, class Real>
[[gnu::always_inline]] inline void take_apart(const Real* nodes, Real* first_nodes, Real* second_nodes) {
  using L = Lanes<Real, width>;
  using Loose = typename LanesOf<Real, width>::Loose;
  using Each = std::make_integer_sequence<int, width>;
  L of_axis[3][lanes / width];
  for (int part = 0; part < lanes / width; ++part) {
    const Loose* in = reinterpret_cast<const Loose*>(nodes + 3 * width * part);
    const L from[3] = {in[0], in[1], in[2]};
    Shuffles<width>::template apart<0>(from, of_axis[0][part], Each{});
    Shuffles<width>::template apart<1>(from, of_axis[1][part], Each{});
    Shuffles<width>::template apart<2>(from, of_axis[2][part], Each{});
  }
  for (int i = 0; i < 3; ++i) {
    L next = nodes[3 * lanes + i] - L{};
    for (int part = lanes / width - 1; part >= 0; --part) {
      const L here = of_axis[i][part];
      LaneView<width, Real>{first_nodes + width * part}[i] = here;
      Shuffles<width>::after(here, next, LaneView<width, Real>{second_nodes + width * part}[i], Each{});
      next = here;
    }
  }
}

/// Vectors of nine nodes in a row += those of the edge of eight cells.
template <int width, class Real>
[[gnu::always_inline]] inline void add_together(const Real* first_nodes, const Real* second_nodes, Real* nodes) {
  using L = Lanes<Real, width>;
  using Loose = typename LanesOf<Real, width>::Loose;
  using Each = std::make_integer_sequence<int, width>;
  L before[3] = {};
  for (int part = 0; part < lanes / width; ++part) {
    const LaneView<width, const Real> first{first_nodes + width * part}, second{second_nodes + width * part};
    L from[3], sum[3];
    for (int i = 0; i < 3; ++i) {
      const L here = second[i];
      L shifted;
      Shuffles<width>::before(before[i], here, shifted, Each{});
      from[i] = first[i] + shifted;
      before[i] = here;
    }
    Shuffles<width>::template together<0>(from, sum[0], Each{});
    Shuffles<width>::template together<1>(from, sum[1], Each{});
    Shuffles<width>::template together<2>(from, sum[2], Each{});
    Loose* to = reinterpret_cast<Loose*>(nodes + 3 * width * part);
    for (int n = 0; n < 3; ++n) to[n] += sum[n];
  }
  for (int i = 0; i < 3; ++i) nodes[3 * lanes + i] += before[i][width - 1];
}

/// The vectors of the cells of one row: nodes 2 r of lane 0 are `row`[r].
template <int width, class Real>
[[gnu::always_inline]] inline void gather_row(const std::array<std::int32_t, 4>& row, const Real* x, Real* values) {
  for (int edge = 0; edge < 4; ++edge) {
    Real* const first = values + 6 * lanes * edge;
    take_apart<width>(x + 3 * std::ptrdiff_t{row[edge]}, first, first + 3 * lanes);
  }
}
template <int width, class Real>
[[gnu::always_inline]] inline void add_row(const std::array<std::int32_t, 4>& row, const Real* values, Real* y) {
  for (int edge = 0; edge < 4; ++edge) {
    const Real* const first = values + 6 * lanes * edge;
    add_together<width>(first, first + 3 * lanes, y + 3 * std::ptrdiff_t{row[edge]});
  }
}

/// out = lanes of `one` before `split`, the others of `other`; shape (24, 8) each
template <int width, class Real>
[[gnu::always_inline]] inline void join(int split, const Real* one, const Real* other, Real* out) {
  using L = Lanes<Real, width>;
  for (int first = 0; first < lanes; first += width) {
    L lane{};
    for (int n = 0; n < width; ++n) lane[n] = static_cast<Real>(first + n);
    const auto is_before = lane < static_cast<Real>(split) - L{};
    const LaneView<width, const Real> of_one{one + first}, of_other{other + first};
    const LaneView<width, Real> to{out + first};
    for (int n = 0; n < 24; ++n) to[n] = is_before ? of_one[n] : of_other[n];
  }
}

/// values = vectors of the nodes of each cell, shape (24, 8)
template <int width, class Real>
[[gnu::always_inline]] inline void gather(const BatchNodes& nodes, const Real* x, Real* values) {
  if (nodes.split > 0) {
    gather_row<width>(nodes.rows[0], x, values);
    if (nodes.split == lanes) return;
    alignas(64) Real second[24 * lanes];
    gather_row<width>(nodes.rows[1], x, second);
    join<width>(nodes.split, values, second, values);
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
  if (nodes.split == lanes) return add_row<width>(nodes.rows[0], values, y);
  if (nodes.split > 0) {
    alignas(64) Real of_row[24 * lanes];
    alignas(64) constexpr Real nothing[24 * lanes] = {};
    join<width>(nodes.split, values, nothing, of_row);
    add_row<width>(nodes.rows[0], of_row, y);
    join<width>(nodes.split, nothing, values, of_row);
    add_row<width>(nodes.rows[1], of_row, y);
    return;
  }
  for (int lane = 0; lane < nodes.count; ++lane)
    for (std::size_t a = 0; a < 8; ++a)
      for (std::size_t i = 0; i < 3; ++i)
        y[3 * static_cast<std::size_t>(nodes.cells[lane][a]) + i] +=
            values[lanes * (3 * a + i) + static_cast<std::size_t>(lane)];
}

}  // namespace hexsolver
