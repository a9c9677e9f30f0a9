// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexsolver/report/outcome.h"
#include "level/level_problem.h"
#include "terms/cell_measures.h"

namespace hexsolver {

/// A state of a level as a result, and what follows from it: energies, reactions, contacts, measures of the cells,
/// memory, warnings.
/// @param so_far  a report whose member converged and levels are filled
Outcome make_result(const hexmesh::Lattice& lattice, const LevelProblem& problem, const NodeVector& u,
                    SolveReport so_far);

/// A state of a level with the measures of its cells; without displacements of surface and conditions.
hexmesh::Result state_of_cells(const hexmesh::Lattice& lattice, int level, const ElasticCells& elastic,
                               const NodeVector& u, CellMeasures measures);

/// Add to each effect the seconds that the terms of a potential took for it.
void add_effect_seconds(const Potential& potential, SolveReport& report);

}  // namespace hexsolver
