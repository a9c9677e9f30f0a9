// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <vector>

#include "hexmesh/core/grid.h"

namespace hexsolver {

/// A vector that changes with time: linear between its rows, constant before the first and after the last.
struct History {
  struct Row {
    double time = 0;  ///< [s]
    hexmesh::Vec3 value = hexmesh::Vec3::Zero();
  };
  std::vector<Row> rows;  ///< at least one, ascending times

  hexmesh::Vec3 at(double time) const {
    const auto after =
        std::upper_bound(rows.begin(), rows.end(), time, [](double t, const Row& row) { return t < row.time; });
    if (after == rows.begin()) return rows.front().value;
    if (after == rows.end()) return rows.back().value;
    const Row& before = *(after - 1);
    return before.value + (time - before.time) / (after->time - before.time) * (after->value - before.value);
  }
};

/// How far the loads of a scene are.
struct Progress {
  double fraction = 1;  ///< of prescribed displacements; in an equilibrium also of forces
  double time = 0;      ///< of a motion [s]

  friend bool operator==(const Progress&, const Progress&) = default;
};

}  // namespace hexsolver
