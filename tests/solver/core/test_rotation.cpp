// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "core/rotation.h"
#include "support/bodies.h"

namespace test_rotation {

using namespace hexsolver;
using testing_support::random_rotation;

void expect_polar(const Mat3& f) {
  const Polar p = polar_decomposition(f);
  EXPECT_TRUE((p.rotation.transpose() * p.rotation).isIdentity(1e-12)) << f;
  EXPECT_NEAR(p.rotation.determinant(), 1, 1e-12) << f;
  EXPECT_LT((p.rotation * p.stretch - f).norm(), 1e-12 * std::max(1.0, f.norm())) << f;
  EXPECT_LT((p.stretch - p.stretch.transpose()).norm(), 1e-12 * std::max(1.0, f.norm())) << f;
}

TEST(Polar, IsAProperRotationTimesASymmetricStretch) {
  for (unsigned seed = 1; seed <= 200; ++seed) {
    const auto values = testing_support::noise(9, 1, seed);
    expect_polar(Mat3::Map(values.data()));
  }
}

TEST(Polar, IsDefinedForFlatLineAndPoint) {
  const Mat3 r = random_rotation(3);
  for (const Vec3& stretch : {Vec3(1, 1, 0), Vec3(1, 0, 0), Vec3(0, 0, 0), Vec3(1, 1, -1), Vec3(-1, -1, -1)}) {
    expect_polar(r * stretch.asDiagonal());
    EXPECT_TRUE(polar_decomposition(r * stretch.asDiagonal()).inverse_m.allFinite());
  }
}

TEST(Polar, FindsTheRotationOfARotatedStretch) {
  const Mat3 r = random_rotation(5), v = random_rotation(6);
  const Mat3 s = v * Vec3(1.6, 1.1, 0.4).asDiagonal() * v.transpose();
  EXPECT_LT((polar_decomposition(r * s).rotation - r).norm(), 1e-12);
}

TEST(Polar, AnInvertedCellKeepsTheRotationOfItsLongSides) {
  const Mat3 r = random_rotation(8);
  const Polar p = polar_decomposition(r * Vec3(1, 1.1, -0.2).asDiagonal());
  EXPECT_LT((p.rotation - r).norm(), 1e-12);
  EXPECT_NEAR(p.stretch.determinant(), -0.22, 1e-12);
}

TEST(Polar, CellsMirroredInAnyPlaneFlipAlike) {
  // All ways to flip are equally short. R = F diag(1, 1, -1) is the one along the material's z.
  const Mat3 along_z = Vec3(1, 1, -1).asDiagonal();
  for (unsigned seed = 1; seed <= 50; ++seed) {
    const Vec3 n = random_rotation(seed).col(0);
    const Mat3 f = random_rotation(seed + 100) * (Mat3::Identity() - 2 * n * n.transpose());
    for (const double scale : {1e-3, 1.0, 1e3}) {
      const Polar p = polar_decomposition(scale * f);
      EXPECT_LT((p.rotation - f * along_z).norm(), 1e-12) << seed;
      EXPECT_LT((p.stretch - scale * along_z).norm(), 1e-12 * scale) << seed;
    }
    // Two that are equal: the flip stays across the one that is not.
    const Mat3 q = random_rotation(seed + 200);
    const Vec3 sigma(2, 1, 1);
    const Mat3 g = f * q * sigma.asDiagonal() * q.transpose();
    const Polar p = polar_decomposition(g);
    EXPECT_NEAR(p.rotation.determinant(), 1, 1e-12);
    EXPECT_LT((p.rotation.transpose() * g - p.stretch).norm(), 1e-9) << seed;
    EXPECT_LT((p.stretch * q.col(0) - 2 * q.col(0)).norm(), 1e-9) << seed;
  }
}

TEST(Polar, DerivativeMatchesCentralDifferences) {
  const Mat3 f = random_rotation(2) * (Mat3() << 1.2, 0.3, 0, -0.1, 0.8, 0.2, 0, 0.1, 1.1).finished();
  const auto values = testing_support::noise(9, 1, 4);
  const Mat3 df = Mat3::Map(values.data());
  constexpr double h = 1e-6;
  const Polar p = polar_decomposition(f);
  const Mat3 measured = p.rotation.transpose() *
                        (polar_decomposition(f + h * df).rotation - polar_decomposition(f - h * df).rotation) / (2 * h);
  const Mat3 a = p.rotation.transpose() * df - df.transpose() * p.rotation;
  const Vec3 w = p.inverse_m * Vec3(a(2, 1), a(0, 2), a(1, 0));
  Mat3 cross;
  cross << 0, -w[2], w[1], w[2], 0, -w[0], -w[1], w[0], 0;
  EXPECT_LT((measured - cross).norm(), 1e-8);
}

TEST(Orthonormalized, IsARotationOfAnyThreeColumns) {
  const Mat3 r = random_rotation(3);
  Mat3 upper;
  upper << 2, 0.5, -3, 0, 0.1, 4, 0, 0, 7;
  EXPECT_LT((orthonormalized(r * upper) - r).norm(), 1e-13);
  Mat3 parallel, flat, mirrored = Mat3::Identity();
  parallel << 1, 2, 3, 1, 2, 3, 1, 2, 3;
  flat.setZero();
  mirrored(2, 2) = -1;
  for (const Mat3& f : {parallel, flat, mirrored}) {
    const Mat3 q = orthonormalized(f);
    EXPECT_LT((q.transpose() * q - Mat3::Identity()).norm(), 1e-13);
    EXPECT_NEAR(q.determinant(), 1, 1e-13);
  }
}

}  // namespace test_rotation
