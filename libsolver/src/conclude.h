// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexsolver/equilibrium.h"
#include "level_problem.h"

namespace hexsolver {

/// A state of a level as a result, and in the report what follows from it: energies, reactions, contacts, measures of
/// the cells, memory, warnings.
/// @param report  converged and levels are filled
hexmesh::Result conclude(const hexmesh::Lattice& lattice, const LevelProblem& problem, const NodeVector& u,
                         SolveReport& report);

/// Say how many cells of `level` were left out as islands.
void warn_of_dropped_cells(const hexmesh::Lattice& whole, int level, SolveReport& report);

/// The vectors of a field, node by node.
std::vector<Vec3> to_points(const NodeVector& u);

/// Add to each effect the seconds that the problem's terms took for it.
void add_effect_seconds(const LevelProblem& problem, SolveReport& report);

}  // namespace hexsolver
