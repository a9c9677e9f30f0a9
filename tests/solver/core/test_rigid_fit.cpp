// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "core/rigid_fit.h"

namespace test_rigid_fit {

using namespace hexsolver;

struct Points {
  std::vector<double> weights;
  std::vector<Vec3> rest, u;
};

/// Points in a box of these edges, moved by a field of this size and then rigidly.
Points moved_points(const Vec3& edges, double size, const Mat3& rotation, const Vec3& shift) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-1, 1);
  Points p;
  for (int n = 0; n < 200; ++n) {
    const Vec3 x = edges.cwiseProduct(Vec3(number(random), number(random), number(random))) + Vec3(300, -200, 50);
    const Vec3 y = x + size * Vec3(number(random), number(random), number(random));
    p.weights.push_back(1.5 + number(random));
    p.rest.push_back(x);
    p.u.push_back(rotation * y + shift - x);
  }
  return p;
}

double mean_deformation(const Points& p) {
  RigidFit fit;
  for (std::size_t n = 0; n < p.rest.size(); ++n) fit.add(p.weights[n], p.rest[n], p.u[n]);
  fit.solve();
  double sum = 0, weight = 0;
  for (std::size_t n = 0; n < p.rest.size(); ++n) {
    sum += p.weights[n] * fit.deformation(p.rest[n], p.u[n]).norm();
    weight += p.weights[n];
  }
  return sum / weight;
}

const Mat3 turned = Eigen::AngleAxisd(2.5, Vec3(1, -2, 3).normalized()).toRotationMatrix();

TEST(RigidFit, LeavesNothingOfARigidMotion) {
  for (const Vec3& edges : {Vec3(100, 80, 60), Vec3(100, 1, 1), Vec3(100, 100, 0), Vec3(100, 0, 0)})
    EXPECT_LT(mean_deformation(moved_points(edges, 0, turned, {1000, 2000, -500})), 1e-9) << edges.transpose();
}

TEST(RigidFit, ARigidMotionOnTopMakesNoDifference) {
  const double alone = mean_deformation(moved_points({100, 80, 60}, 5, Mat3::Identity(), Vec3::Zero()));
  EXPECT_GT(alone, 3);
  EXPECT_NEAR(mean_deformation(moved_points({100, 80, 60}, 5, turned, {1000, 2000, -500})), alone, 1e-9);
}

TEST(RigidFit, OnePointDoesNotDeform) {
  RigidFit fit;
  fit.add(2, {1, 2, 3}, {4, 5, 6});
  fit.solve();
  EXPECT_LT(fit.deformation({1, 2, 3}, {4, 5, 6}).norm(), 1e-14);
}

}  // namespace test_rigid_fit
