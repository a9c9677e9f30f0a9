// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "hexmesh/lattice/lattice.h"
#include "hexmesh/result/result.h"
#include "hexsolver/scene/scene.h"

namespace testing_support {

/// What is left of the forces on the nodes of a solution, assembled anew and plainly: energies of cells from their
/// voxels (quadratic laws) or their material points (the others) in extended precision, forces by differences of them,
/// loads and obstacles one by one. None of the solver's terms, constraints or element matrices has a part in it; which
/// surface points a selection means, and the nodes of the cells, are its.
struct PlainEquilibrium {
  /// Norm of the forces on the nodes that no force at a held point balances, over that of the sum of the sizes of all
  /// that they are made of, or those of a strain of 1e-7 where that is more.
  double relative_residual = 0;
  /// Largest distance of a held point from its place, of each condition [mm].
  std::vector<double> misfits_mm;
};

/// @param before  of a motion: the state one step of implicit Euler before, `result` has the state after it
/// @returns nothing for what it does not know: cells dropped or held by springs, the paper's rotation by edges, damping
/// in proportion to the stiffness
std::optional<PlainEquilibrium> plain_equilibrium(const hexmesh::Lattice& lattice, const hexsolver::Scene& scene,
                                                  const hexmesh::Result& result,
                                                  const hexmesh::MotionStep* before = nullptr);

}  // namespace testing_support
