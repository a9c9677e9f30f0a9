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

class OnLevel;

/// Forces on the nodes of cells, on those that results have [N]; empty: none.
/// @param level  that graded cells are told on; null: cells alike
std::vector<Vec3> forces_at_points(const NodeVector& forces, const OnLevel* level);

using CellFields = std::map<std::string, std::vector<double>>;

/// A state of cells with their measures, and other fields of them; without displacements of surface and conditions.
/// @param level  that graded cells are told on, exactly: where they are coarser, it is interpolated; null: cells alike
hexmesh::Result state_of_cells(const MeshCells& cells, const ElasticCells& elastic, const NodeVector& u,
                               CellMeasures measures, const OnLevel* level = nullptr, CellFields fields = {});

/// What each obstacle does, without moments.
std::vector<ContactReport> contact_reports(const LevelProblem& problem, const NodeVector& u);

/// Forces of obstacles on the nodes that results have [N]; empty without.
/// @param level  that graded cells are told on; null: cells alike
std::vector<Vec3> contact_forces(const LevelProblem& problem, const NodeVector& u, const OnLevel* level);

/// The fields of cells that change with their state, as state_of_cells has them.
/// @param level  that graded cells are told on; null: cells alike
CellFields changing_fields(const ElasticCells& elastic, const NodeVector& u, const OnLevel* level);

/// Add to each effect the seconds that the terms of a potential took for it.
void add_effect_seconds(const Potential& potential, SolveReport& report);

}  // namespace hexsolver
