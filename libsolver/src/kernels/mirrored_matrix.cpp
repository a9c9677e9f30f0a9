// SPDX-License-Identifier: Apache-2.0
#include "kernels/mirrored_matrix.h"

#include <bit>
#include <cmath>

namespace hexsolver {
namespace {

/// Of an entry of K where its cell is mirrored along an axis.
double entry_mirrored(const CellMatrix& k, int row, int column, int axis) {
  const auto place = [axis](int n) { return 3 * (n / 3 ^ 1 << axis) + n % 3; };
  const bool changes_sign = (row % 3 == axis) != (column % 3 == axis);
  const double entry = k(place(row), place(column));
  return changes_sign ? -entry : entry;
}

/// Of s_m at a corner.
int sign_at(int m, int corner) { return std::popcount(static_cast<unsigned>(m & corner)) % 2 == 0 ? 1 : -1; }

}  // namespace

std::optional<MirroredMatrix<double>> mirrored(const CellMatrix& k) {
  const double rounding = 1e-13 * k.cwiseAbs().maxCoeff();
  for (int axis = 0; axis < 3; ++axis)
    for (int column = 0; column < 24; ++column)
      for (int row = 0; row <= column; ++row)
        if (!(std::abs(entry_mirrored(k, row, column, axis) - k(row, column)) <= rounding)) return {};
  MirroredMatrix<double> out;
  for (int p = 0; p < 8; ++p)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        double sum = 0;  // of corner 0: the other seven come to the same, mirrored
        for (int b = 0; b < 8; ++b) sum += k(i, 3 * b + j) * sign_at(p ^ 1 << j, b);
        out.blocks[9 * p + 3 * i + j] = sum / 8;
      }
  return out;
}

}  // namespace hexsolver
