// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <vector>

#include "hexsolver/scene/scene.h"

namespace hexsolver {

/// Where the tables of a scene bend: what follows them is not smooth there.
class TableCorners {
public:
  /// @param least_step  of the motion [s]; a millionth of it counts as rounding
  TableCorners(const Scene& scene, double least_step) : rounding_(1e-6 * least_step) {
    const auto add = [&](const auto& parts) {
      for (const auto& part : parts)
        if (part.history)
          for (const History::Row& row : part.history->rows) times_.push_back(row.time);
    };
    add(scene.conditions);
    add(scene.forces);
    add(scene.contacts);
    std::sort(times_.begin(), times_.end());
  }

  /// Whether there is one after `from` and before `to` [s].
  bool lie_between(double from, double to) const {
    const auto next = std::upper_bound(times_.begin(), times_.end(), from + rounding_);
    return next != times_.end() && *next < to - rounding_;
  }

private:
  std::vector<double> times_;  ///< ascending [s]
  double rounding_;
};

}  // namespace hexsolver
