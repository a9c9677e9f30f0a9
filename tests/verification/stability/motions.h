// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hexsolver/dynamics/motion.h"
#include "support/bodies.h"

namespace stability {

inline const hexsolver::Vec3 earth(0, 0, -9810);  ///< [mm/s^2]

/// The paper's solver: steps of implicit Euler linearized once, a fixed number of plain conjugate gradients.
hexsolver::Scene starved(hexsolver::Rotation rotation, int iterations = 10, double step = 0.02);

inline const char* name_of(hexsolver::Rotation r) { return r == hexsolver::Rotation::polar ? "polar" : "edges"; }

inline const char* law_name(hexsolver::Elasticity e) {
  using enum hexsolver::Elasticity;
  return e == cauchy           ? "cauchy"
         : e == corotational   ? "corotational"
         : e == green_lagrange ? "green-lagrange"
         : e == neo_hookean    ? "neo-hookean"
                               : "stable-neo-hookean";
}

/// What a motion did.
struct Run {
  bool finished = true;              ///< all steps, with finite displacements and velocities
  std::string reason;                ///< if not
  double largest_gain = 0;           ///< of energy in a step beyond the work given, over the largest energy so far
  std::vector<double> time, energy;  ///< [s], [N mm], with the start
  void append(const Run& next);
};
/// @param keep_every  energies of so many steps are kept
Run run(hexsolver::Motion& motion, int steps, int keep_every = 1);

/// How much a step may gain. Averaged edges have no energy of their own: what stands for it is held by the steps alone,
/// to 1e-6 in each of their parts.
inline double allowed_gain(hexsolver::Rotation r) { return r == hexsolver::Rotation::polar ? 1e-7 : 1e-4; }

inline hexsolver::NodeVector still(const hexsolver::Motion& m) {
  return hexsolver::NodeVector::Zero(m.displacement().size());
}

}  // namespace stability
