// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace hexmesh {

/// (i, j, k); i varies fastest in memory.
using Index3 = std::array<std::int32_t, 3>;

/// The order of memory, for sorting and searching: by k, then j, then i.
constexpr bool i_fastest(const Index3& a, const Index3& b) {
  return std::array{a[2], a[1], a[0]} < std::array{b[2], b[1], b[0]};
}

/// A count or number that is known not to be negative, for arithmetic and comparisons with sizes. Subscripts do
/// without.
constexpr std::size_t as_size(std::int64_t number) { return static_cast<std::size_t>(number); }

/// Number of indices in a box: nx ny nz.
/// @pre extent >= 0
constexpr std::size_t count_in(const Index3& extent) {
  return as_size(extent[0]) * as_size(extent[1]) * as_size(extent[2]);
}

/// Whether 0 <= ijk < extent.
constexpr bool is_in(const Index3& extent, const Index3& ijk) {
  for (std::size_t d = 0; d < 3; ++d)
    if (ijk[d] < 0 || ijk[d] >= extent[d]) return false;
  return true;
}

/// Position in an array over a box: i + nx (j + ny k).
/// @pre is_in(extent, ijk)
constexpr std::size_t offset_in(const Index3& extent, const Index3& ijk) {
  return as_size(ijk[0]) + as_size(extent[0]) * (as_size(ijk[1]) + as_size(extent[1]) * as_size(ijk[2]));
}

/// Inverse of offset_in().
constexpr Index3 index_in(const Index3& extent, std::size_t offset) {
  const std::size_t nx = as_size(extent[0]), ny = as_size(extent[1]);
  return {static_cast<std::int32_t>(offset % nx), static_cast<std::int32_t>(offset / nx % ny),
          static_cast<std::int32_t>(offset / nx / ny)};
}

/// Steps between neighbours along each axis in such an array: 1, nx, nx ny.
constexpr std::array<std::size_t, 3> strides_in(const Index3& extent) {
  return {1, as_size(extent[0]), as_size(extent[0]) * as_size(extent[1])};
}

/// The cell that holds a finer one: indices divided by `factor`, axis by axis.
/// @pre finer >= 0, factor >= 1
constexpr Index3 coarser_index(const Index3& finer, const Index3& factor) {
  return {finer[0] / factor[0], finer[1] / factor[1], finer[2] / factor[2]};
}

/// The first of the finer ones that a cell holds.
constexpr Index3 first_in(const Index3& cell, const Index3& factor) {
  return {cell[0] * factor[0], cell[1] * factor[1], cell[2] * factor[2]};
}

/// How many cells of `factor` finer ones cover a box of finer ones, axis by axis.
/// @pre factor >= 1
constexpr Index3 coarser_extent(const Index3& finer, const Index3& factor) {
  return coarser_index({finer[0] + factor[0] - 1, finer[1] + factor[1] - 1, finer[2] + factor[2] - 1}, factor);
}

/// One number in the order of i_fastest(), which sorts faster. @pre each index is in [0, 2^21)
constexpr std::uint64_t sort_key(const Index3& i) {
  return static_cast<std::uint64_t>(i[2]) << 42 | static_cast<std::uint64_t>(i[1]) << 21 |
         static_cast<std::uint64_t>(i[0]);
}

}  // namespace hexmesh
