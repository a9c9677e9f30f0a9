// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "equilibrium/error_estimator.h"
#include "hexsolver/equilibrium/equilibrium.h"
#include "hexsolver/plan/plan.h"
#include "hexsolver/scene/scene_files.h"
#include "support/bodies.h"
#include "support/scene_texts.h"

/// What a solution is expected to cost, and where an accuracy or a budget is expected to end.
namespace test_plan {

using namespace hexsolver;
using namespace testing_support;

Lattice bar() {
  return one_material({24, 12, 12}, {1, 1, 1}, [](const Index3&) { return true; });
}

Scene asking(const std::string& keys) {
  return parse_scene("[solve]\nstrain = \"cauchy\"\n" + keys + held_by_an_end, "test", "");
}

TEST(Plan, AnAccuracyThatCoarseLevelsKeepEndsWhereItsSolutionDoes) {
  const Lattice lattice = bar();
  // From one that the second level keeps to one that only fine ones do.
  const SolveReport known = solve_equilibrium(lattice, asking("accuracy_mm = 1e-9\n"), 0).report;
  for (const double part : {3.0, 30.0}) {
    const LevelReport& of = known.levels[known.levels.size() - 2];
    ASSERT_TRUE(of.error.mean_mm);
    Scene scene = asking("accuracy_mm = 1\n");
    scene.accuracy = part * *of.error.mean_mm;
    const SolveReport report = solve_equilibrium(lattice, scene, 0).report;
    const SolvePlan plan = plan_solution(lattice, scene, 0);
    ASSERT_TRUE(plan.end);
    EXPECT_EQ(plan.end->level, report.levels.back().level) << plan.end->why;
    EXPECT_EQ(plan.levels.back().level, plan.end->level);
    ASSERT_EQ(plan.levels.size(), report.levels.size());
    for (std::size_t l = 0; l < plan.levels.size(); ++l) EXPECT_EQ(plan.levels[l].cells, report.levels[l].cells);
    if (plan.end->level > 0) {
      ASSERT_TRUE(plan.look);
      EXPECT_EQ(plan.look->level, plan.end->level - 1);
      EXPECT_GT(plan.look->seconds, 0);
    }
    EXPECT_LE(plan.seconds(), 1.001 * plan.end->most_seconds);
  }
}

TEST(Plan, AnAccuracyThatNoLevelKeepsGoesToTheFinest) {
  const SolvePlan plan = plan_solution(bar(), asking("accuracy_mm = 1e-9\n"), 0);
  ASSERT_TRUE(plan.end);
  EXPECT_EQ(plan.end->level, 0);
  EXPECT_EQ(plan.levels.back().level, 0);
  EXPECT_FALSE(plan.look);
  EXPECT_FALSE(plan.end->why.empty());
}

TEST(Plan, ABudgetEndsBeforeWhatItHasNoTimeFor) {
  const Lattice lattice = bar();
  const SolvePlan all = plan_solution(lattice, asking("budget_s = 1e6\n"), 0);
  ASSERT_TRUE(all.end);
  EXPECT_EQ(all.end->level, 0);
  EXPECT_EQ(all.end->why, "");
  Scene hasty = asking("budget_s = 1\n");
  hasty.budget = 1e-9;
  const SolvePlan first = plan_solution(lattice, hasty, 0);
  ASSERT_TRUE(first.end);
  EXPECT_EQ(first.levels.size(), 1U);  // the coarsest is always solved
  EXPECT_EQ(first.end->level, first.levels[0].level);
  EXPECT_NE(first.end->why, "");
}

TEST(Plan, ALevelThatIsNamedEndsThere) {
  const SolvePlan plan = plan_solution(bar(), asking(""), 1);
  EXPECT_FALSE(plan.end);
  EXPECT_EQ(plan.levels.back().level, 1);
}

TEST(Plan, ErrorsGoOnFallingAsTheyDid) {
  EXPECT_EQ(rate_of_errors({3}), rate_of_errors({}));
  EXPECT_DOUBLE_EQ(rate_of_errors({5, 2, 1}), 0.5);
  EXPECT_LT(rate_of_errors({1, 4}), 1);  // they fall
  EXPECT_GT(rate_of_errors({1, 0}), 0);
}

}  // namespace test_plan
