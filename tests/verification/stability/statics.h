// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "newton/minimize.h"
#include "support/bodies.h"

namespace stability {

/// Equilibrium of one level from any state, with the energies passed on the way.
struct Descent {
  hexsolver::NewtonReport report;
  hexsolver::NodeVector u;
  double start_energy = 0;  ///< as given, before supports hold [N mm]
  double end_energy = 0;    ///< [N mm]
  double largest_rise = 0;  ///< of energy from one step to the next while supports hold, over the largest energy
};

Descent descend(const testing_support::Lattice& lattice, testing_support::Body& body,
                const std::vector<hexsolver::ConstraintPoint>& held, const hexsolver::NodeVector& start,
                int max_iterations = 200, double tolerance = 1e-8);

}  // namespace stability
