// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "hexsolver/core/vectors.h"
#include "linear/conjugate_gradients.h"

namespace hexsolver {

/// A linear equation whose matrix need not be symmetric.
struct GeneralEquation {
  using Map = std::function<void(const NodeVector& x, NodeVector& y)>;
  Map multiply;      ///< y = A x
  Map precondition;  ///< y = M^-1 x
};

struct GmresOptions {
  double relative_tolerance = 1e-2;  ///< of |M^-1 (b - A x)| over |M^-1 b|
  int most_iterations = 500;
  std::function<bool()> interrupt;  ///< asked before every iteration; true ends it
};

struct GmresOutcome {
  int iterations = 0;
  ConjugateGradients::End end = ConjugateGradients::End::solved;
};

/// x = A^-1 b by GMRES from 0, preconditioned from the left.
/// Source: Saad, Iterative Methods for Sparse Linear Systems, 2nd ed. (2003), section 6.5; Eigen's implementation.
GmresOutcome solve_by_gmres(const GeneralEquation& equation, const NodeVector& b, const GmresOptions& options,
                            NodeVector& x);

}  // namespace hexsolver
