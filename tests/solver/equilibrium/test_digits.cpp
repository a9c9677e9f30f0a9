// SPDX-License-Identifier: Apache-2.0
// Stiffnesses and forces at the ends of what the digits of numbers bear.
#include <gtest/gtest.h>

#include "support/bodies.h"
#include "support/files.h"
#include "support/solve.h"

namespace test_digits {

using namespace hexsolver;
using namespace testing_support;

Condition held(const Vec3& point, const Vec3& normal) {
  Condition c;
  c.name = c.where = "end";
  c.selection.halfspace = HalfSpace{point, normal};
  return c;
}

/// 8 x 4 x 4 voxels of 2 mm; those with x >= 4 of the second material.
Lattice two_halves(double first_kpa, double second_kpa, double poisson = 0.3) {
  const hexmesh::LabelVolume volume =
      make_volume({8, 4, 4}, {2, 2, 2}, [](const Index3& i) { return i[0] < 4 ? 1 : 2; });
  return hexmesh::build_lattice(volume,
                                {{volume.segments[0], hexmesh::material_from_units(first_kpa, poisson, 1000), 0, ""},
                                 {volume.segments[1], hexmesh::material_from_units(second_kpa, poisson, 1000), 0, ""}},
                                {3, {0, 0, 0}});
}

bool tells_rounding(const SolveReport& report) {
  return std::any_of(report.warnings.begin(), report.warnings.end(),
                     [](const std::string& w) { return w.find("count as rounding") != std::string::npos; });
}

TEST(Digits, ASmallForceOnAStiffBodyMovesIt) {
  // Steel, and a force that strains it by 1e-12: rotating cells find what small strain does.
  const Lattice lattice = box({10, 5, 5}, {2, 2, 2}, 2e8, 0.3);
  for (const Elasticity law : {Elasticity::corotational, Elasticity::neo_hookean})
    for (int level = 0; level < 2; ++level) {
      Scene scene;
      scene.conditions = {held({-0.9, 0, 0}, {-1, 0, 0})};
      Force force;
      force.name = force.where = "tip";
      force.selection.halfspace = HalfSpace{{18.9, 0, 0}, {1, 0, 0}};
      force.total = {0, 0, -1e-4};
      scene.forces = {force};
      scene.elasticity = Elasticity::cauchy;
      SolveReport small, large;
      const hexmesh::Result expected = solve_equilibrium(lattice, scene, level, small);
      scene.elasticity = law;
      const hexmesh::Result result = solve_equilibrium(lattice, scene, level, large);
      ASSERT_TRUE(small.converged && large.converged) << large.reason;
      EXPECT_GE(large.levels.back().newton.iterations, 1);
      double most = 0, off = 0;
      for (std::size_t n = 0; n < result.displacement.size(); ++n) {
        most = std::max(most, expected.displacement[n].norm());
        off = std::max(off, (result.displacement[n] - expected.displacement[n]).norm());
      }
      EXPECT_GT(most, 1e-12);
      EXPECT_LT(off, 1e-3 * most) << "law " << static_cast<int>(law) << " level " << level;
      EXPECT_NEAR(large.conditions[0].reaction_n[2], 1e-4, 1e-7);
      EXPECT_TRUE(tells_rounding(large));
    }
}

TEST(Digits, TheWeightOfSoftMaterialBesideStiffIsBorne) {
  for (const double ratio : {1e2, 1e6, 1e9}) {
    Scene scene;
    scene.elasticity = Elasticity::corotational;
    scene.conditions = {held({-0.9, 0, 0}, {-1, 0, 0})};
    scene.gravity = {0, 0, -9810};
    SolveReport report;
    solve_equilibrium(two_halves(5 * ratio, 5), scene, 0, report);
    ASSERT_TRUE(report.converged) << ratio << ": " << report.reason;
    const double weight = 128 * 8 * 1e-9 * 9810;
    EXPECT_NEAR(report.conditions[0].reaction_n[2], weight, 1e-3 * weight) << ratio;
    EXPECT_LT(report.balance.sum().force_n.norm(), 1e-3 * weight) << ratio;
    EXPECT_EQ(tells_rounding(report), ratio > 1e8);
  }
}

TEST(Digits, StiffnessesThatAreTooFarApartAreRefused) {
  Scene scene;
  scene.conditions = {held({-0.9, 0, 0}, {-1, 0, 0})};
  scene.gravity = {0, 0, -9810};
  SolveReport report;
  const std::string message =
      message_of(hexmesh::ErrorKind::input, [&] { solve_equilibrium(two_halves(1e-3, 1e8), scene, 0, report); });
  EXPECT_NE(message.find("0.001 to 1e+08 kPa"), std::string::npos) << message;
  scene.dynamics = Dynamics{.step = 0.01, .duration = 0.02};
  EXPECT_EQ(message_of(hexmesh::ErrorKind::input, [&] { solve_dynamics(two_halves(1e-3, 1e8), scene, 0, report); }),
            message);
}

TEST(Effort, OfAStepIsBoundedWhateverTheSolver) {
  for (const StepSolver solver : {StepSolver::cg, StepSolver::jacobi}) {
    Scene scene;
    scene.conditions = {held({-0.9, 0, 0}, {-1, 0, 0})};
    scene.gravity = {0, 0, -9810};
    scene.dynamics = Dynamics{.step = 0.02, .duration = 0.2, .solver = solver};
    SolveReport report;
    solve_dynamics(two_halves(1, 1e9, 0.49), scene, 1, report);
    EXPECT_FALSE(report.converged);
    EXPECT_LE(report.motion->steps, 9);
    EXPECT_LT(report.levels.back().newton.linear_iterations, 60'000 * (report.motion->steps + 1));
    EXPECT_NE(report.reason.find("iterations"), std::string::npos) << report.reason;
  }
}

}  // namespace test_digits
