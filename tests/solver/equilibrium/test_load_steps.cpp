// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "equilibrium/load_steps.h"
#include "level/coarser_levels.h"
#include "support/bodies.h"
#include "support/solve.h"

namespace test_load_steps {

using namespace hexsolver;
using namespace testing_support;

// Turned as it is a body has no energy but that of rounding, which no line search can follow.
TEST(LoadSteps, TurnABodyOfAnyLawByItsSupports) {
  const Lattice lattice = box({8, 6, 6}, {2, 2, 2}, 10, 0.45);
  const Vec3 axis = Vec3(1, 2, 2).normalized(), about(50, 0, 0);
  for (const Elasticity law :
       {Elasticity::corotational, Elasticity::neo_hookean, Elasticity::stable_neo_hookean, Elasticity::green_lagrange})
    for (const double degrees : {90.0, 675.0, 720.0})
      for (int level = 0; level < 3; ++level) {
        SCOPED_TRACE(testing::Message() << "law " << static_cast<int>(law) << " by " << degrees << " level " << level);
        Scene scene;
        scene.elasticity = law;
        if (law == Elasticity::green_lagrange) scene.volumetric = Volumetric::full;
        Condition end;
        end.name = end.where = "end";
        end.selection.halfspace = HalfSpace{{-0.9, 0, 0}, {-1, 0, 0}};
        end.turn = Turn{axis, degrees * std::numbers::pi / 180, about};
        scene.conditions = {end};
        SolveReport report;
        const hexmesh::Result result = solve_equilibrium(lattice, scene, level, report);
        ASSERT_TRUE(report.converged) << report.reason;
        const Mat3 turn = Eigen::AngleAxisd(end.turn->radians, axis).toRotationMatrix();
        double off = 0;
        for (std::size_t n = 0; n < result.nodes.size(); ++n)
          off = std::max(off,
                         (turn * (result.nodes[n] - about) + about - result.nodes[n] - result.displacement[n]).norm());
        EXPECT_LT(off, 1e-5);
        EXPECT_LT(report.strain_energy_n_mm, 1e-12);
      }
}

// Far too soft for its weight: no level carries it, the finer the less, which finer levels need not show.
TEST(LoadSteps, LevelsThatCarryLessAndLessEndTheSolution) {
  const Lattice lattice = box({24, 24, 24}, {8, 8, 8}, 0.3, 0.49);
  Scene scene;
  scene.gravity = {0, 0, -9810};
  Condition base;
  base.name = base.where = "base";
  base.selection.halfspace = HalfSpace{{0, 0, -3.9}, {0, 0, -1}};
  scene.conditions = {base};
  SolveReport report;
  const hexmesh::Result result = solve_equilibrium(lattice, scene, 0, report);
  EXPECT_FALSE(report.converged);
  EXPECT_NE(report.reason.find("no finer level was tried"), std::string::npos) << report.reason;
  ASSERT_GE(report.levels.size(), 2U);
  EXPECT_GT(report.levels.back().level, 0);
  EXPECT_EQ(result.level, report.levels.back().level) << "the state is of the last level that was tried";
}

TEST(LoadSteps, FewCellsThatOnlyLeadAreTriedForLess) {
  const auto count_tries = [](Aim aim, int newton_iterations) {
    LoadSteps steps(1, false, aim);
    NewtonReport failed;
    failed.iterations = failed.linear_iterations = newton_iterations;
    int tries = 1;
    while (steps.add(failed)) ++tries;
    return tries;
  };
  // All of the load, a half, ... to 1/64 and one more; as 31 linear iterations each 100 steps are 3,100 of 10,000.
  EXPECT_EQ(count_tries(Aim::result, 100), 7);
  EXPECT_EQ(count_tries(Aim::lead, 100), 4);
  EXPECT_EQ(count_tries(Aim::lead, 20), 7);
  EXPECT_EQ(count_tries(Aim::look, 1), 1);

  LoadSteps steps(1.0 / 16, false, Aim::lead);  // steps that succeed count for nothing
  NewtonReport done;
  done.converged = true;
  done.iterations = done.linear_iterations = 1000;
  int tries = 1;
  while (steps.add(done)) ++tries;
  EXPECT_EQ(tries, 16);
  EXPECT_TRUE(steps.total().converged);
}

TEST(Budget, ANextLevelIsExpectedToTakeAPowerOfItsCells) {
  LevelReport coarse, fine;
  coarse.cells = 100;
  coarse.seconds = 0.2;
  fine.cells = 800;
  fine.seconds = 0.8;  // the power 2/3
  EXPECT_NEAR(expected_seconds({coarse, fine}, 6400), 3.2, 1e-12);
  EXPECT_NEAR(expected_seconds({fine}, 6400), 0.8 * std::pow(8, 1.1), 1e-12);  // the most, where nothing tells
  fine.seconds = 0.1;
  EXPECT_NEAR(expected_seconds({coarse, fine}, 3200), 0.2, 1e-12);  // never below the power 1/2
  coarse.cells = 800;
  EXPECT_NEAR(expected_seconds({coarse, fine}, 800), 0.1, 1e-12);
}

}  // namespace test_load_steps
