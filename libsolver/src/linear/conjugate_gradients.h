// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "constraints/constraints.h"
#include "terms/potential.h"

namespace hexsolver {

/// z = M^-1 r, M symmetric positive definite, in the range of the projection P of the constraints.
class Preconditioner {
public:
  virtual ~Preconditioner() = default;
  virtual void apply(const NodeVector& r, NodeVector& z) const = 0;
};

/// M = the 3x3 blocks of the diagonal of a Hessian.
class BlockJacobi final : public Preconditioner {
public:
  /// @param constraints  must outlive this
  explicit BlockJacobi(const Constraints& constraints) : constraints_(constraints) {}

  void update(const Potential& potential);  ///< `potential` is linearized
  void apply(const NodeVector& r, NodeVector& z) const override;

private:
  const Constraints& constraints_;
  std::vector<Mat3> inverse_;  ///< per node
};

/// Conjugate gradients for P A P d = P b in the range of P, from d = 0, A the Hessian of a linearized potential.
/// Space for vectors is kept between solutions.
class ConjugateGradients {
public:
  struct Options {
    int most_iterations = 500;
    double relative_tolerance = 0;  ///< ends once |r| <= this |P b| ...
    std::function<double(const NodeVector& d)>
        excess;                       ///< ... and this, by what factor |r| is still too large, is <= 1
    std::function<bool()> interrupt;  ///< asked before every iteration; true ends it
    /// Searched first, and part of the space in which every iterate is the best (augmented conjugate gradients: Saad,
    /// Yeung, Erhel, Guyomarc'h 2000). It need not be in the range of P, and counts as no iteration.
    const NodeVector* first_direction = nullptr;
  };
  enum class End { solved, negative_curvature, indefinite_preconditioner, interrupted };
  struct Outcome {
    int iterations = 0;
    End end = End::solved;  ///< negative curvature, or of the preconditioner: d is the best before it was met
    double reduction = 1;   ///< |r| over |P b| before the last iteration
    double product_seconds = 0, preconditioner_seconds = 0;
  };

  /// @param preconditioner  nullptr: none
  Outcome solve(const Potential& potential, const Constraints& constraints, const Preconditioner* preconditioner,
                const NodeVector& b, const Options& options, NodeVector& d);

private:
  NodeVector r_, z_, p_, q_, first_, of_first_;
};

}  // namespace hexsolver
