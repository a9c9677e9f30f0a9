// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "support/bodies.h"
#include "terms/hyperelastic.h"

namespace test_hyperelastic {

using namespace hexsolver;
using namespace testing_support;

constexpr double mu = 0.7, kappa = 2.3;

Mat3 deformation(unsigned seed) {
  return random_rotation(seed) * Vec3(0.8, 1.1, 1.4).asDiagonal() * random_rotation(seed + 1);
}

class Laws : public testing::TestWithParam<Elasticity> {
protected:
  EnergyDensity at(const Mat3& f) const {
    return energy_density(GetParam(), invariants(f - Mat3::Identity()), mu, kappa);
  }
  double textbook(const Mat3& f) const {
    const Mat3 e = (f.transpose() * f - Mat3::Identity()) / 2;
    const double j = f.determinant(), i1 = f.squaredNorm();
    const double lambda = kappa - 2 * mu / 3;
    switch (GetParam()) {
      case Elasticity::green_lagrange:
        return mu * e.squaredNorm() + lambda / 2 * e.trace() * e.trace();
      case Elasticity::neo_hookean:
        return mu / 2 * (std::pow(j, -2.0 / 3) * i1 - 3) + kappa / 2 * (j - 1) * (j - 1);
      default: {  // Smith et al. 2018, equation 14, by their reparametrised Lame parameters
        const double m = 4.0 / 3 * mu, l = lambda + 5.0 / 6 * mu, alpha = 1 + m / l - m / (4 * l);
        const auto w = [&](double i, double volume) {
          return m / 2 * (i - 3) + l / 2 * (volume - alpha) * (volume - alpha) - m / 2 * std::log(i + 1);
        };
        return w(i1, j) - w(3, 1);
      }
    }
  }
};

TEST_P(Laws, AreThoseOfTheTextbooks) {
  for (unsigned seed = 1; seed < 6; ++seed)
    EXPECT_NEAR(at(deformation(seed)).value, textbook(deformation(seed)), 1e-13);
}

TEST_P(Laws, EnergyNearRestKeepsItsDigits) {
  // mu |dev eps|^2 + kappa/2 tr(eps)^2 to relative order h.
  const Mat3 h = 1e-7 * Mat3(random_rotation(4) * Vec3(1, -0.4, 0.7).asDiagonal());
  const Mat3 eps = (h + h.transpose()) / 2;
  const Mat3 dev = eps - eps.trace() / 3 * Mat3::Identity();
  const double expected = mu * dev.squaredNorm() + kappa / 2 * eps.trace() * eps.trace();
  EXPECT_NEAR(energy_density(GetParam(), invariants(h), mu, kappa).value, expected, 1e-5 * expected);
}

TEST_P(Laws, StressIsTheDerivativeOfTheEnergy) {
  const Mat3 f = deformation(3);
  const Mat3 p = first_piola(at(f), f);
  constexpr double h = 1e-6;
  for (int i = 0; i < 9; ++i) {
    Mat3 step = Mat3::Zero();
    step(i % 3, i / 3) = h;
    EXPECT_NEAR(p(i % 3, i / 3), (at(f + step).value - at(f - step).value) / (2 * h), 1e-8);
  }
}

TEST_P(Laws, TangentIsTheDerivativeOfTheStressAlsoAtEqualStretches) {
  std::vector<Mat3> states = {deformation(5), 1.2 * random_rotation(7), Mat3::Identity()};
  if (GetParam() == Elasticity::stable_neo_hookean)  // also inside out
    states.push_back(random_rotation(5) * Vec3(-0.5, 1.1, 1.4).asDiagonal() * random_rotation(6));
  for (const Mat3& f : states) {
    const Tangent t = tangent(at(f), f);
    const Mat3 step = random_rotation(9) * Vec3(0.3, -1, 0.6).asDiagonal();
    const Mat3 in_frame = t.u.transpose() * step * t.v;
    Mat3 claimed;
    claimed.diagonal() = t.stretch * in_frame.diagonal();
    for (int k = 0; k < 3; ++k) {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      claimed(i, j) = t.same[k] * in_frame(i, j) + t.other[k] * in_frame(j, i);
      claimed(j, i) = t.same[k] * in_frame(j, i) + t.other[k] * in_frame(i, j);
    }
    claimed = t.u * claimed * t.v.transpose();
    constexpr double h = 1e-6;
    const Mat3 up = f + h * step, down = f - h * step;
    EXPECT_LT((claimed - (first_piola(at(up), up) - first_piola(at(down), down)) / (2 * h)).norm(), 1e-8);
  }
}

TEST_P(Laws, ClampingTakesNegativeEigenvaluesAway) {
  // Strong compression along one axis.
  const Mat3 f = random_rotation(2) * Vec3(0.4, 1, 1).asDiagonal() * random_rotation(3);
  const auto smallest = [](const Tangent& t) {
    return std::min({Eigen::SelfAdjointEigenSolver<Mat3>(t.stretch).eigenvalues()[0], (t.same + t.other).minCoeff(),
                     (t.same - t.other).minCoeff()});
  };
  const Tangent t = tangent(at(f), f);
  EXPECT_LT(smallest(t), -1e-2);
  EXPECT_GT(smallest(projected(t)), -1e-14);
  const Tangent twice = projected(projected(t)), once = projected(t);
  EXPECT_LT((twice.stretch - once.stretch).norm() + (twice.same - once.same).norm(), 1e-14);
  const Tangent half = projected(t, 0.5);
  EXPECT_LT((half.stretch - (t.stretch + once.stretch) / 2).norm(), 1e-14);
  EXPECT_LT((half.same - (t.same + once.same) / 2).norm() + (half.other - (t.other + once.other) / 2).norm(), 1e-14);
}

INSTANTIATE_TEST_SUITE_P(All, Laws,
                         testing::Values(Elasticity::green_lagrange, Elasticity::neo_hookean,
                                         Elasticity::stable_neo_hookean));

TEST(Hyperelastic, AtRestTheHessianIsTheStiffness) {
  // The 27 moments of the points are those that the stiffness is made of.
  const Lattice lattice = bitten_ball({1, 1, 2.5}, {0, 1, 0});
  const std::vector<std::pair<Elasticity, Volumetric>> laws = {{Elasticity::green_lagrange, Volumetric::full},
                                                               {Elasticity::neo_hookean, Volumetric::full},
                                                               {Elasticity::neo_hookean, Volumetric::mean},
                                                               {Elasticity::stable_neo_hookean, Volumetric::full},
                                                               {Elasticity::stable_neo_hookean, Volumetric::mean}};
  for (int level = 0; level < 4; ++level)
    for (const auto& [law, volumetric] : laws) {
      Body body(lattice, level, law, volumetric);
      const Body linear(lattice, level, Elasticity::cauchy, volumetric);
      for (const double clamping : {Hessian::exact, Hessian::projected}) {
        body.potential.linearize(NodeVector::Zero(static_cast<Eigen::Index>(body.mesh.num_dofs())), clamping);
        for (std::size_t c = 0; c < body.mesh.num_cells(); ++c) {
          const CellMatrix k = linear.potential.cell_hessian(c);
          ASSERT_LT((body.potential.cell_hessian(c) - k).norm(), 1e-6 * k.norm()) << level;
        }
      }
    }
}

TEST(Hyperelastic, StressIsThatOfTheLawAndTheLimitIsSeen) {
  const Lattice lattice = bitten_ball({1, 1, 2.5}, {0, 1, 0});
  const Mat3 f = random_rotation(3) * Vec3(0.5, 1.1, 1.2).asDiagonal();
  for (const Elasticity law : {Elasticity::green_lagrange, Elasticity::neo_hookean, Elasticity::stable_neo_hookean}) {
    const bool bounded = law == Elasticity::green_lagrange;
    const Body body(lattice, 1, law, bounded ? Volumetric::full : Volumetric::mean);
    const NodeVector u = sample(body.mesh, [&](const Vec3& x) -> Vec3 { return f * x - x; });
    EXPECT_EQ(body.elastic->limit_reached(u, false).empty(), !bounded);
    for (std::size_t c = 0; c < body.mesh.num_cells(); ++c) {
      const ElementModel& m = body.elastic->model(c);
      const EnergyDensity w = energy_density(law, invariants(f - Mat3::Identity()), m.shear, m.bulk);
      const Mat3 expected = first_piola(w, f) * f.transpose() / f.determinant();
      EXPECT_LT((body.elastic->stress(c, u) - expected).norm(), 1e-10 * expected.norm());
      EXPECT_NEAR(body.elastic->jacobians(c, u).least, f.determinant(), 1e-10);
    }
  }
}

TEST(Hyperelastic, APointInsideOutHasInfiniteEnergyUnlessTheLawBearsIt) {
  const Lattice lattice = box({2, 2, 2}, {1, 1, 1});
  const auto energy = [&](Elasticity law) {
    const Body body(lattice, 0, law, Volumetric::full);
    return body.potential.energy(sample(body.mesh, [](const Vec3& x) { return Vec3(-1.5 * x[0], 0, 0); }));
  };
  EXPECT_TRUE(std::isinf(energy(Elasticity::green_lagrange)));
  EXPECT_TRUE(std::isinf(energy(Elasticity::neo_hookean)));
  EXPECT_TRUE(std::isfinite(energy(Elasticity::stable_neo_hookean)));
}

}  // namespace test_hyperelastic
