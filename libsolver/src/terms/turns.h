// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "terms/elastic.h"

namespace hexsolver {

/// By how much each cell is rotated: the angle of the polar rotation of its mean gradient [rad].
std::vector<double> turns_of(const ElasticCells& cells, const NodeVector& u);

/// Squares of these angles over the material [rad^2 mm^3]: what cells that do not rotate take for strain.
struct SquaresOfTurns {
  double all = 0;
  double below = 0;  ///< of cells that are rotated by an angle at most

  double share() const { return all > 0 ? below / all : 1; }
};
SquaresOfTurns squares_of_turns(const ElasticCells& cells, const NodeVector& u, double angle);

}  // namespace hexsolver
