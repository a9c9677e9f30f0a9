// SPDX-License-Identifier: Apache-2.0
#include "terms/turns.h"

#include "core/rotation.h"

namespace hexsolver {

std::vector<double> turns_of(const ElasticCells& cells, const NodeVector& u) {
  std::vector<double> out;
  for (std::size_t c = 0; c < cells.mesh().num_cells(); ++c)
    out.push_back(rotation_angle(polar_decomposition(cells.mean_gradient(c, u)).rotation));
  return out;
}

SquaresOfTurns squares_of_turns(const ElasticCells& cells, const NodeVector& u, double angle) {
  SquaresOfTurns sum;
  const std::vector<double> turns = turns_of(cells, u);
  for (std::size_t c = 0; c < turns.size(); ++c) {
    const double square = cells.model(c).volume * turns[c] * turns[c];
    sum.all += square;
    if (turns[c] <= angle) sum.below += square;
  }
  return sum;
}

}  // namespace hexsolver
