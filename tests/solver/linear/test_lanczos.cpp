// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "linear/lanczos.h"

namespace test_lanczos {

using namespace hexsolver;

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

TEST(Lanczos, NoiseIsThatOfIndependentNumbers) {
  // Of n numbers in [-1/2, 1/2]: means and products with the next along any axis are of size 1 / sqrt(n).
  constexpr int n = 30;
  double sum = 0, squares = 0, products[4] = {};
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i)
        for (std::uint64_t axis = 0; axis < 3; ++axis) {
          const double value = noise_at({i, j, k}, axis);
          EXPECT_LE(std::abs(value), 0.5);
          sum += value;
          squares += value * value;
          products[0] += value * noise_at({i + 1, j, k}, axis);
          products[1] += value * noise_at({i, j + 1, k}, axis);
          products[2] += value * noise_at({i, j, k + 1}, axis);
          products[3] += value * noise_at({i, j, k}, (axis + 1) % 3);
        }
  constexpr double count = 3.0 * n * n * n;
  const double variance = 1.0 / 12, four_sigma = 4 / std::sqrt(count);
  EXPECT_NEAR(sum / count, 0, four_sigma * std::sqrt(variance));
  EXPECT_NEAR(squares / count, variance, four_sigma * std::sqrt(1.0 / 180));
  for (const double product : products) EXPECT_NEAR(product / count, 0, four_sigma * variance);
}

TEST(Lanczos, FindsTheLargestEigenvalueWithinItsMargin) {
  // Of S A: the largest of the generalised problem A x = lambda S^-1 x, from below, and 10 % more.
  constexpr Index n = 300;
  VectorXd start(n), scale(n);
  MatrixXd a = MatrixXd::Zero(n, n);
  for (Index i = 0; i < n; ++i) {
    start[i] = noise_at({static_cast<std::int32_t>(i), 0, 0}, 0);
    scale[i] = 1.0 / (1 + static_cast<double>(i % 7));
    a(i, i) = 2.0 + static_cast<double>(i % 5);
    if (i > 0) a(i, i - 1) = a(i - 1, i) = -1;
  }
  const VectorXd root = scale.cwiseSqrt();
  const double largest =
      Eigen::SelfAdjointEigenSolver<MatrixXd>(root.asDiagonal() * a * root.asDiagonal(), Eigen::EigenvaluesOnly)
          .eigenvalues()[n - 1];
  VectorXd z, p, q;
  const double found = largest_eigenvalue(
      LanczosSpace<VectorXd>{start, z, p, q}, [&](const VectorXd& x, VectorXd& y) { y = a * x; },
      [&](const VectorXd& x, VectorXd& y) { y = scale.cwiseProduct(x); },
      [](const VectorXd& x, const VectorXd& y) { return x.dot(y); });
  EXPECT_LE(found, 1.1 * largest * (1 + 1e-12));
  EXPECT_GE(found, largest);
}

TEST(Lanczos, GoesOnToAnEigenvalueThatLiesApart) {
  // Of a few nodes that the start hardly touches: 12 steps come to rest at what all others have.
  constexpr Index n = 4476;
  constexpr double apart = 3.63;
  for (std::int32_t seed = 0; seed < 5; ++seed) {
    VectorXd eigenvalues(n), start(n), z, p, q;
    for (Index i = 0; i < n; ++i) {
      const hexmesh::Index3 at = {static_cast<std::int32_t>(i), seed, 0};
      start[i] = noise_at(at, 0);
      eigenvalues[i] = 3.19 * (1 - std::sqrt(0.5 + noise_at(at, 1)));
    }
    start[17] = 0.003;
    eigenvalues[17] = apart;
    const double found = largest_eigenvalue(
        LanczosSpace<VectorXd>{start, z, p, q},
        [&](const VectorXd& x, VectorXd& y) { y = eigenvalues.cwiseProduct(x); },
        [](const VectorXd& x, VectorXd& y) { y = x; }, [](const VectorXd& x, const VectorXd& y) { return x.dot(y); });
    EXPECT_GE(found, 1.09 * apart) << "seed " << seed;
    EXPECT_LE(found, 1.1 * apart * (1 + 1e-12)) << "seed " << seed;
  }
}

}  // namespace test_lanczos
