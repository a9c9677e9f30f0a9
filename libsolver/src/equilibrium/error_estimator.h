// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "hexsolver/report/report.h"
#include "terms/elastic.h"

namespace hexsolver {

/// Coarser levels only provide a start.
inline constexpr double nested_tolerance = 1e-4;

/// What one level differs from the coarser one before it, and what both are expected to differ from the limit.
class ErrorEstimator {
public:
  /// Levels come coarse to fine; `difference` is that to the level before, nothing for one without.
  /// Writes the estimates of the last levels into `levels`.
  void add(const std::optional<ElasticCells::Size>& difference, std::vector<LevelReport>& levels) {
    // Errors fall from level to level by about `fall`: between h^2, inside the body, and h, at the rims of patches.
    // With e the error of a level and d its difference from the coarser one, d = e / fall - e. Differences scatter,
    // since each level holds patches by other nodes: the larger of what the last two lead to is taken. On the coarsest
    // levels, where patches and the body itself are a few cells, errors fall less.
    constexpr double fall = 0.32, part = fall / (1 - fall), coarsest_part = 0.75;
    if (!difference) {
      differences_.clear();
      return;
    }
    ErrorEstimate& now = levels.back().error;
    now.mean_mm = differences_.empty() ? coarsest_part * difference->mean
                                       : part * std::max(difference->mean, fall * differences_.back().mean);
    // Extremes sit where the limit is approached slowest: no more is expected of the next level than of the last.
    now.max_mm = difference->largest;
    differences_.push_back(*difference);
    // What is known about coarser levels gets sharper.
    double mean = *now.mean_mm, largest = *now.max_mm;
    for (std::size_t n = 0; n < differences_.size(); ++n) {
      mean += differences_[differences_.size() - 1 - n].mean;
      largest += differences_[differences_.size() - 1 - n].largest;
      ErrorEstimate& coarser = levels[levels.size() - 2 - n].error;
      coarser.mean_mm = mean;
      coarser.max_mm = largest;
    }
  }

private:
  std::vector<ElasticCells::Size> differences_;
};

}  // namespace hexsolver
