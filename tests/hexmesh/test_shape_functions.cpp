// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "hexmesh/geometry/shape_functions.h"

namespace test_shape_functions {

using namespace hexmesh;

TEST(Shape, FunctionsSumToOneAndAreOneAtTheirOwnCorner) {
  EXPECT_NEAR(shape_functions({0.2, 0.7, 1.3}).sum(), 1, 1e-15);
  for (int a = 0; a < 8; ++a) {
    const NodeWeights n = shape_functions(Vec3(a & 1, a >> 1 & 1, a >> 2));
    EXPECT_EQ(n, NodeWeights::Unit(a));
  }
}

TEST(Shape, GradientsMatchCentralDifferences) {
  const Vec3 s(0.3, 0.6, 0.1);
  constexpr double h = 1e-5;
  const NodeGradients g = shape_gradients(s);
  for (int d = 0; d < 3; ++d) {
    const NodeWeights difference =
        (shape_functions(s + h * Vec3::Unit(d)) - shape_functions(s - h * Vec3::Unit(d))) / (2 * h);
    EXPECT_LT((g.col(d) - difference).norm(), 1e-10);
  }
}

}  // namespace test_shape_functions
