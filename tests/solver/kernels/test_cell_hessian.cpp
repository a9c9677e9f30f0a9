// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "kernels/cell_hessian.h"
#include "solver/kernels/symmetric_matrix.h"

namespace test_cell_hessian {

using namespace hexsolver;
using namespace testing_support;

/// Without symmetry.
CellMatrix full(unsigned seed) {
  const NodeVector numbers = noise(576, 1, seed);
  return Eigen::Map<const CellMatrix>(numbers.data());
}

TEST(CellProduct, InterpolationFromTheParentIsTrilinear) {
  for (const Index3& factor : {Index3{2, 2, 2}, Index3{2, 1, 2}, Index3{1, 1, 2}, Index3{1, 1, 1}})
    for (int slot = 0; slot < 8; ++slot) {
      // Corners of the child among those of the parent.
      CellMatrix l = CellMatrix::Zero();
      for (int a = 0; a < 8; ++a) {
        Vec3 local;
        for (int d = 0; d < 3; ++d)
          local[d] = factor[static_cast<std::size_t>(d)] == 1
                         ? hexmesh::corner_bit(a, d)
                         : 0.5 * (hexmesh::corner_bit(slot, d) + hexmesh::corner_bit(a, d));
        const NodeWeights weights = hexmesh::shape_functions(local);
        for (int b = 0; b < 8; ++b) l.block<3, 3>(3 * a, 3 * b) = weights[b] * Mat3::Identity();
      }
      const CellMatrix k = symmetric(7);
      CellMatrix found = k;
      interpolate_from_parent({slot, factor}, found.data());
      EXPECT_LT((found - l.transpose() * k * l).norm(), 1e-13 * k.norm()) << slot;
      const CellMatrix m = full(11);
      CellMatrix of_rows = m, of_columns = m;
      interpolate_from_parents({slot, factor}, {0, {1, 1, 1}}, of_rows.data());
      interpolate_from_parents({0, {1, 1, 1}}, {slot, factor}, of_columns.data());
      EXPECT_LT((of_rows - l.transpose() * m).norm(), 1e-13 * m.norm()) << slot;
      EXPECT_LT((of_columns - m * l).norm(), 1e-13 * m.norm()) << slot;
    }
}

TEST(CellProduct, OfTwoCellsIsThatOfTheMatrixAndItsTranspose) {
  const CellMatrix m = full(11);
  const CellVector x = noise(24, 1, 12), y = noise(24, 1, 13);
  CellVector of_x, of_y;
  multiply24_both(m.data(), x.data(), y.data(), of_y.data(), of_x.data());
  EXPECT_LT((of_y - m * y).norm(), 1e-13 * m.norm());
  EXPECT_LT((of_x - m.transpose() * x).norm(), 1e-13 * m.norm());
}

TEST(CellProduct, APointsHessianIsThatOfItsWeights) {
  const Eigen::Matrix<double, 8, 1> a = noise(8, 1, 14), b = noise(8, 1, 15);
  const NodeVector numbers = noise(9, 1, 16);
  const Mat3 h = Eigen::Map<const Mat3>(numbers.data());
  CellMatrix found = symmetric(7), expected = found;
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < 8; ++j) expected.block<3, 3>(3 * i, 3 * j) += a[i] * b[j] * h;
  add_point_product(a.data(), b.data(), h.data(), found.data());
  EXPECT_LT((found - expected).norm(), 1e-14 * expected.norm());
}

TEST(CellProduct, TheRotatedHessianIsThatOfItsFormula) {
  const CellMatrix k = symmetric(8), before = symmetric(9);
  const NodeVector numbers = noise(216, 1, 10);
  using Rows = Eigen::Matrix<double, 3, 24, Eigen::RowMajor>;
  const Rows t = Eigen::Map<const Rows>(numbers.data()), b = Eigen::Map<const Rows>(numbers.data() + 72),
             z = Eigen::Map<const Rows>(numbers.data() + 144);
  const Mat3 r = random_rotation(11);
  CellMatrix rotation_matrix = CellMatrix::Zero();
  for (int a = 0; a < 24; a += 3) rotation_matrix.block<3, 3>(a, a) = r;
  for (const bool projected : {false, true}) {
    CellMatrix found = before;
    add_rotated_hessian(k.data(), t.data(), b.data(), projected ? z.data() : nullptr, r.data(), found.data());
    CellMatrix inner = k + t.transpose() * b + b.transpose() * t;
    if (projected) inner += z.transpose() * z;
    const CellMatrix expected = before + rotation_matrix * inner * rotation_matrix.transpose();
    EXPECT_LT((found - expected).norm(), 1e-13 * expected.norm());
  }
}

TEST(CellProduct, ProductsOfRowsAreAdded) {
  const NodeVector numbers = noise(2 * 9 * 24, 1, 17);
  using Nine = Eigen::Matrix<double, 9, 24, Eigen::RowMajor>;
  const Nine a = Eigen::Map<const Nine>(numbers.data()), b = Eigen::Map<const Nine>(numbers.data() + 9 * 24);
  CellMatrix found = symmetric(18);
  const CellMatrix expected = found + a.transpose() * b;
  add_products24(a.data(), b.data(), found.data());
  EXPECT_LT((found - expected).norm(), 1e-14 * expected.norm());
}

}  // namespace test_cell_hessian
