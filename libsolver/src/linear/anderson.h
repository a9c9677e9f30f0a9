// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hexsolver/core/vectors.h"

namespace hexsolver {

/// Anderson's acceleration of a fixed point x = g(x): the next iterate is where the last steps, taken as linear, say
/// that nothing is left of r = g(x) - x.
/// Source: Walker, Ni, SIAM J. Numer. Anal. 49 (2011) 1715.
class Anderson {
public:
  /// @param most  steps that are remembered
  explicit Anderson(std::size_t most) : most_(most) {}

  NodeVector next(const NodeVector& x, const NodeVector& r);

private:
  std::size_t most_;
  NodeVector last_x_, last_r_;
  std::vector<NodeVector> of_x_, of_r_;  ///< differences, oldest first
};

}  // namespace hexsolver
