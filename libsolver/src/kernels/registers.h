// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <type_traits>
#include <utility>

#include "mesh/mesh.h"

namespace hexsolver {

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

constexpr int lanes = Mesh::batch_size;  ///< cells of a batch

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
  /// Lanes of one register and the next as if in a row: from the second lane on.
  template <class L, int... lane>
  [[gnu::always_inline]] static void after(const L& one, const L& next, L& to, std::integer_sequence<int, lane...>) {
    to = __builtin_shufflevector(one, next, (lane + 1)...);
  }
  /// From the last lane of the one before on.
  template <class L, int... lane>
  [[gnu::always_inline]] static void before(const L& one, const L& next, L& to, std::integer_sequence<int, lane...>) {
    to = __builtin_shufflevector(one, next, (lane + width - 1)...);
  }
  template <int part, class L, int... lane>
  [[gnu::always_inline]] static void together(const L* from, L& to, std::integer_sequence<int, lane...>) {
    const L two = __builtin_shufflevector(from[0], from[1], together_of_two(part * width + lane)...);
    to = __builtin_shufflevector(two, from[2], together_of_third(part * width + lane)...);
  }
};

}  // namespace hexsolver
