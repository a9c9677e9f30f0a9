// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "hexsolver/constraints.h"
#include "hexsolver/multigrid.h"

namespace hexsolver {

struct NewtonOptions {
  double tolerance = 1e-8;          ///< on the relative residual |P g| / |sum of absolute cell forces and loads|
  int max_iterations = 25;          ///< what converges takes 4 to 12
  int max_linear_iterations = 500;  ///< per Newton step
  bool estimate_remaining = true;   ///< fill NewtonReport::remaining, for one V-cycle
  std::function<bool()> interrupt;  ///< asked before every linear iteration; true ends it
};

/// Where the time went [s].
struct NewtonSeconds {
  double forces = 0;     ///< and energies, with the frames of cells
  double linearize = 0;  ///< what else Hessians of cells take
  double set_up = 0;     ///< of the multigrid levels
  double cycles = 0;     ///< of multigrid
  double products = 0;   ///< with the Hessian, outside of cycles

  NewtonSeconds& operator+=(const NewtonSeconds& other);
};

struct NewtonReport {
  bool converged = false;
  std::string reason;  ///< why it ended
  int iterations = 0;
  int linear_iterations = 0;
  double relative_residual = 0;
  bool interrupted = false;
  std::size_t preconditioner_bytes = 0;  ///< of memory
  NewtonSeconds seconds;
  /// What one more step would add, by one V-cycle: an estimate of how far u is from the exact solution. Where it
  /// converged, if asked.
  NodeVector remaining;
};

/// What is called after every Newton step: iteration, relative residual, linear iterations of the step.
using NewtonProgress = std::function<void(int, double, int)>;

/// Minimise the potential energy under H u = c by Newton's method from u.
///
/// Each step solves the linearised problem by conjugate gradients in the subspace that leaves the supports alone,
/// preconditioned by one V-cycle; a step along which the Hessian is not positive falls back to the clamped one;
/// a backtracking line search keeps the energy falling once the supports hold (of forces that are no gradient: the
/// residual).
NewtonReport minimize(const Hierarchy& hierarchy, Potential& potential, const Constraints& constraints,
                      const NewtonOptions& options, NodeVector& u, const NewtonProgress& progress = {});

}  // namespace hexsolver
