// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "hexsolver/dynamics/motion.h"
#include "hexsolver/equilibrium/equilibrium.h"

// For tests that look at a result and at its report apart. Found beside the functions of the same names.
namespace hexsolver {

inline hexmesh::Result solve_equilibrium(const hexmesh::Lattice& lattice, const Scene& scene, int level,
                                         SolveReport& report) {
  Outcome outcome = solve_equilibrium(lattice, scene, level);
  report = std::move(outcome.report);
  return std::move(outcome.result);
}

inline hexmesh::Result solve_dynamics(const hexmesh::Lattice& lattice, const Scene& scene, int level,
                                      SolveReport& report) {
  Outcome outcome = solve_dynamics(lattice, scene, level);
  report = std::move(outcome.report);
  return std::move(outcome.result);
}

}  // namespace hexsolver
