// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "equilibrium/error_estimator.h"

namespace test_error_estimator {

using namespace hexsolver;

using Size = ElasticCells::Size;

/// Levels whose error against a limit is errors[i], all in one direction.
ErrorEstimator compared(const std::vector<double>& errors, int levels_beyond) {
  ErrorEstimator estimator;
  for (std::size_t n = 0; n < errors.size(); ++n) {
    std::vector<std::optional<Size>> differences;
    for (std::size_t i = 0; i < n; ++i) {
      const double d = std::abs(errors[i] - errors[n]);
      differences.push_back(i + 2 < n ? std::optional<Size>() : Size{d, 3 * d});
    }
    const int finer = static_cast<int>(errors.size() - 1 - n) + levels_beyond;
    estimator.add(std::move(differences), {10 + errors[n], {Vec3(0, 0, 2 + errors[n])}}, finer);
  }
  return estimator;
}

std::vector<LevelReport> estimate(const std::vector<double>& errors, int levels_beyond, std::size_t reported) {
  std::vector<LevelReport> levels(reported);
  compared(errors, levels_beyond).write(levels);
  return levels;
}

TEST(ErrorEstimator, IsExactWhereDifferencesFallByOneRate) {
  // 1, r, r^2, ... of which the finest levels are not known.
  for (const double r : {0.25, 0.5, 0.6})
    for (const int beyond : {1, 2, 5}) {
      const double finest = std::pow(r, 3 + beyond);
      const auto levels = estimate({1, r, r * r, r * r * r}, beyond, 4);
      for (std::size_t i = 0; i < 3; ++i) {
        const double truth = std::pow(r, i) - finest;
        ASSERT_TRUE(levels[i].error.mean_mm) << r << ' ' << beyond << ' ' << i;
        EXPECT_NEAR(*levels[i].error.mean_mm, truth, 1e-12);
        EXPECT_NEAR(*levels[i].error.max_mm, 3 * truth, 1e-12);
        EXPECT_NEAR(*levels[i].error.strain_energy_n_mm, truth, 1e-12);
        EXPECT_NEAR(*levels[i].error.reactions_n[0], truth, 1e-12);
        EXPECT_NEAR(*levels[i].error.of_reactions, truth / (2 + r * r * r), 1e-12);
      }
      EXPECT_FALSE(levels[3].error.mean_mm);  // nothing finer was looked at
    }
}

TEST(ErrorEstimator, DifferencesThatTurnBackAreTakenForWhatTheyAre) {
  // Errors of changing sign: 1, -1/2, 1/4, ...
  ErrorEstimator estimator;
  const auto error = [](int n) { return std::pow(-0.5, n); };
  for (int n = 0; n < 4; ++n) {
    std::vector<std::optional<Size>> differences;
    for (int i = 0; i < n; ++i) {
      const double d = std::abs(error(i) - error(n));
      differences.push_back(i + 2 < n ? std::optional<Size>() : Size{d, d});
    }
    estimator.add(std::move(differences), {10 + error(n), {Vec3(0, 0, 2 + error(n))}}, 5 - n);
  }
  std::vector<LevelReport> levels(4);
  estimator.write(levels);
  // What turns back is left out, as it may go on all the same: what the levels show, which is more than what is left.
  const double shown = std::abs(error(2) - error(3)), truth = std::abs(error(2) - error(5));
  EXPECT_NEAR(*levels[2].error.mean_mm, shown, 1e-12);
  EXPECT_NEAR(*levels[2].error.strain_energy_n_mm, shown, 1e-12);
  EXPECT_NEAR(*levels[2].error.reactions_n[0], shown, 1e-12);
  EXPECT_LT(shown, 1.4 * truth);
}

TEST(ErrorEstimator, AStepThatIsShortByChanceCountsForMore) {
  // Errors 1, 0.1 and below: the last step is little beside the one before.
  const auto of_middle = [](double step) { return *estimate({1, 0.1, 0.1 - step}, 1, 3)[1].error.mean_mm; };
  const double before = 0.9, least = 0.2, chance = 0.15;
  for (const double step : {0.13, 0.1, 0.07})
    EXPECT_NEAR(of_middle(step), chance * before * (1 + least), 1e-12) << step;
  for (const double step : {0.06, 0.01, 0.001})  // at most twice
    EXPECT_NEAR(of_middle(step), 2 * step * (1 + least), 1e-12) << step;
  EXPECT_NEAR(of_middle(0.14), 0.14 * (1 + least), 1e-12);
  EXPECT_NEAR(of_middle(0.27), 0.27 * 1.3, 1e-12);
}

TEST(ErrorEstimator, WhatCellsHideIsUnknown) {
  const auto is_first_known = [](const Averages& first, const Averages& finer, int beyond) {
    ErrorEstimator estimator;
    estimator.add({}, {10, {}, first}, beyond + 1);
    estimator.add({Size{1, 1}}, {11, {}, finer}, beyond);
    std::vector<LevelReport> levels(2);
    estimator.write(levels);
    EXPECT_EQ(levels[0].error.is_hidden, !levels[0].error.mean_mm);
    return levels[0].error.mean_mm.has_value();
  };
  const auto mean_of_first = [&](double mixture, double finer_mixture, int beyond) {
    return is_first_known({mixture, {}}, {finer_mixture, {}}, beyond);
  };
  EXPECT_TRUE(mean_of_first(0, 0, 2));
  EXPECT_FALSE(mean_of_first(2, 2, 2));   // layers of single voxels
  EXPECT_TRUE(mean_of_first(2, 0.9, 2));  // most of them are resolved
  EXPECT_TRUE(mean_of_first(0.04, 0.04, 2));
  EXPECT_TRUE(mean_of_first(2, 0, 0));  // the voxels themselves
  const auto with_gap = [&](const hexmesh::OpenGaps& gaps, int beyond) {
    return is_first_known({0, gaps}, {0, {0.2, 0.1, 0}}, beyond);
  };
  EXPECT_FALSE(with_gap({0.1, 0.04, 0.04}, 2));  // it ends at the same place in both
  EXPECT_TRUE(with_gap({0.1, 0.04, 0.02}, 2));
  EXPECT_TRUE(with_gap({0.01, 0.04, 0.04}, 2));  // a groove
  EXPECT_TRUE(with_gap({0.1, 0, 0}, 2));
  EXPECT_TRUE(with_gap({0.1, 0.04, 0.04}, 0));
}

TEST(ErrorEstimator, AtTheFinestLevelOfTheLatticeItIsTheDistanceFromCellsOfNoSize) {
  const auto levels = estimate({1, 0.5, 0.25}, 0, 3);
  EXPECT_NEAR(*levels[2].error.mean_mm, 0.25, 1e-12);
  EXPECT_NEAR(*levels[1].error.mean_mm, 0.25, 1e-12);  // the others against that level
  EXPECT_NEAR(*levels[0].error.mean_mm, 0.75, 1e-12);
}

TEST(ErrorEstimator, ALevelThatWasOnlyLookedAtTellsOfTheOneBefore) {
  const auto levels = estimate({1, 0.4, 0.16}, 1, 2);
  ASSERT_TRUE(levels[1].error.mean_mm);
  EXPECT_NEAR(*levels[1].error.mean_mm, 0.4 - 0.064, 1e-12);
}

TEST(ErrorEstimator, DifferencesThatDoNotFallTellNothing) {
  // Cells that lock: each level comes closer by more than the one before.
  for (const LevelReport& level : estimate({10, 9.5, 8, 4}, 2, 3)) EXPECT_FALSE(level.error.mean_mm);
  EXPECT_FALSE(estimate({10}, 2, 1)[0].error.mean_mm);
  EXPECT_FALSE(estimate({10, 4}, 0, 2)[1].error.mean_mm);  // two levels show no rate
}

TEST(ErrorEstimator, ErrorsAreKnownOnceTheFinestLevelIs) {
  EXPECT_FALSE(compared({8, 4}, 1).knows_finest());
  EXPECT_TRUE(compared({8, 4, 0}, 0).knows_finest());
  EXPECT_NEAR(*estimate({8, 4, 0}, 0, 3)[1].error.mean_mm, 4, 1e-12);
}

TEST(ErrorEstimator, LevelsCloseInWhereTheLastThreeDo) {
  for (const auto& [errors, closes_in] : std::vector<std::pair<std::vector<double>, bool>>{{{8, 4, 2}, true},
                                                                                           {{8, 4, 1.3}, true},
                                                                                           {{8, 4, 1.1}, false},
                                                                                           {{10, 9, 5, 4}, true},
                                                                                           {{10, 4, 3, 2}, false},
                                                                                           {{4, 2}, true}})
    EXPECT_EQ(compared(errors, 2).closes_in(), closes_in) << errors[errors.size() - 2] << ' ' << errors.back();
}

TEST(ErrorEstimator, LevelsWhoseCellsAreNotAllHalvedShowNoRate) {
  for (const double step : {0.01, 0.3, 2.0}) {
    ErrorEstimator estimator(false);
    estimator.add({}, {1, {}}, 4);
    estimator.add({Size{1, 1}}, {1, {}}, 3);
    estimator.add({Size{1, 1}, Size{step, step}}, {1, {}}, 2);
    std::vector<LevelReport> levels(2);
    estimator.write(levels);
    const double rest = step * (0.45 + 0.45 * 0.45);
    EXPECT_NEAR(*levels[1].error.mean_mm, step + rest, 1e-12);
    EXPECT_NEAR(*levels[0].error.mean_mm, 1 + rest, 1e-12);
    // The last is forgotten: another level goes on from those before.
    estimator.forget_last();
    estimator.add({Size{1, 1}, Size{step, step}}, {1, {}}, 0);
    levels.resize(3);
    estimator.write(levels);
    EXPECT_NEAR(*levels[1].error.mean_mm, step, 1e-12);
    EXPECT_FALSE(levels[2].error.mean_mm);
  }
}

TEST(ErrorEstimator, BeginsAnewWhereALevelDoesNotGoOnFromTheOneBefore) {
  ErrorEstimator estimator;
  estimator.add({}, {1, {}}, 3);
  estimator.add({Size{1, 1}}, {1, {}}, 2);
  std::vector<LevelReport> levels(2);
  estimator.write(levels);
  ASSERT_TRUE(levels[0].error.mean_mm);
  const double before = *levels[0].error.mean_mm;
  estimator.add({}, {1, {}}, 1);
  levels.resize(3);
  estimator.write(levels);
  EXPECT_EQ(*levels[0].error.mean_mm, before);
  EXPECT_FALSE(levels[2].error.mean_mm);
}

}  // namespace test_error_estimator
