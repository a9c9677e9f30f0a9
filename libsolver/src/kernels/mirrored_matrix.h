// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include "mesh/mesh.h"

namespace hexsolver {

/// K (24, 24) of a cell that is the same mirrored along each axis, as full ones of one material are.
///
/// A field of the nodes is a sum of the eight products s_m of 1 and the signs of the corners along x, y, z; bit d of m
/// says whether that of axis d is in it. Mirrored along an axis, component i of s_m changes sign if m has the axis or i
/// is the axis, but not if both. K couples only what changes alike: s_m's component i where m = p ^ 1 << i, for each p
/// a block (3, 3).
template <class Real>
struct MirroredMatrix {
  std::array<Real, 72> blocks;  ///< of p = 0, 1, ..., each (3, 3), symmetric, divided by 64 = |s_m|^4

  static constexpr int place(int p, int i) { return 3 * (p ^ 1 << i) + i; }  ///< of component i of block p among all

  template <class Other>
  MirroredMatrix<Other> cast() const {
    MirroredMatrix<Other> other;
    for (std::size_t n = 0; n < blocks.size(); ++n) other.blocks[n] = static_cast<Other>(blocks[n]);
    return other;
  }
};

/// @returns nothing where K is not the same mirrored, to 1e-13 of its largest entry
std::optional<MirroredMatrix<double>> mirrored(const CellMatrix& k);

/// K of cells alike, to be multiplied with.
template <class Real>
struct AlikeMatrix {
  const Real* full = nullptr;                      ///< (24, 24) symmetric
  const MirroredMatrix<Real>* mirrored = nullptr;  ///< the same; may be null
};

}  // namespace hexsolver
