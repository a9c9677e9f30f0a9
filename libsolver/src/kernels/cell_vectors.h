// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "kernels/cell_hessian.h"
#include "mesh/mesh.h"

namespace hexsolver {

inline CellVector times(const CellMatrix& k, const CellVector& x) {
  CellVector y;
  multiply24(k.data(), x.data(), y.data());
  return y;
}

/// The vector of each node rotated.
inline CellVector rotate(const Mat3& r, const CellVector& x) {
  CellVector y;
  for (int a = 0; a < 8; ++a) y.segment<3>(3 * a) = r * x.segment<3>(3 * a);
  return y;
}

/// blocks += the 3x3 blocks of the diagonal of R K R^T.
inline void add_diagonal(const Mat3& r, const CellMatrix& k, std::array<Mat3, 8>& blocks) {
  for (int a = 0; a < 8; ++a) blocks[a] += r * k.block<3, 3>(3 * a, 3 * a) * r.transpose();
}

/// R K R^T, for a symmetric K whose lower triangle of 3x3 blocks is read.
inline CellMatrix rotate(const Mat3& r, const CellMatrix& k) {
  CellMatrix out;
  for (int a = 0; a < 8; ++a)
    for (int b = 0; b <= a; ++b) {
      out.block<3, 3>(3 * a, 3 * b) = r * k.block<3, 3>(3 * a, 3 * b) * r.transpose();
      out.block<3, 3>(3 * b, 3 * a) = out.block<3, 3>(3 * a, 3 * b).transpose();
    }
  return out;
}

}  // namespace hexsolver
