// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/QR>

#include "kernels/span_product.h"

namespace test_span_product {

using namespace hexsolver;

/// D D^T v of numbers of rows and directions that fill no registers, for each number of columns.
template <class Real>
void expect_parts_in_spans(double tolerance) {
  for (const auto& [rows, count] : {std::pair(1, 1), {7, 3}, {16, 16}, {33, 5}, {150, 62}})
    for (int columns = 1; columns <= 3; ++columns) {
      const Eigen::MatrixXd directions =
          Eigen::HouseholderQR<Eigen::MatrixXd>(Eigen::MatrixXd::Random(rows, rows)).householderQ() *
          Eigen::MatrixXd::Identity(rows, count);
      Span<Real> span;
      span.set(directions);
      EXPECT_GE(span.rows, static_cast<std::size_t>(rows));
      using Columns = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
      const auto filled = static_cast<Eigen::Index>(span.rows);
      Columns v = Columns::Zero(filled, columns), part = Columns::Constant(filled, columns, 7);
      v.topRows(rows).setRandom();
      part_in_span(span, columns, v.data(), part.data());
      const Eigen::MatrixXd expected = directions * (directions.transpose() * v.topRows(rows).template cast<double>());
      EXPECT_LT((part.topRows(rows).template cast<double>() - expected).norm(), tolerance) << rows << " " << columns;
      EXPECT_EQ(part.bottomRows(filled - rows).norm(), 0);
    }
}

TEST(SpanProduct, IsThePartInTheSpan) {
  expect_parts_in_spans<double>(1e-14);
  expect_parts_in_spans<float>(1e-5);
}

}  // namespace test_span_product
