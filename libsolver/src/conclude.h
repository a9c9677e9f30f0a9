// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include "hexsolver/cell_measures.h"
#include "hexsolver/equilibrium.h"
#include "level_problem.h"

namespace hexsolver {

/// A state of a level as a result, and in the report what follows from it: energies, reactions, contacts, measures of
/// the cells, memory, warnings.
/// @param report  converged and levels are filled
hexmesh::Result conclude(const hexmesh::Lattice& lattice, const LevelProblem& problem, const NodeVector& u,
                         SolveReport& report);

/// A state of a level with the measures of its cells; without displacements of surface and conditions.
hexmesh::Result state_of_cells(const hexmesh::Lattice& lattice, int level, const ElasticCells& elastic,
                               const NodeVector& u, CellMeasures measures);

/// Where the law or the state have no meaning.
struct CellChanges {
  std::size_t cells = 0;     ///< that these are counted of
  std::size_t strained = 0;  ///< beyond what Hooke's law is meant for
  std::size_t turned = 0;    ///< beyond what small strain is meant for
  std::size_t inverted = 0;
  double least_jacobian = std::numeric_limits<double>::infinity();
};

/// @param result       a state with measures
/// @param first, count  cells that count
CellChanges count_changes(const hexmesh::Result& result, std::size_t first, std::size_t count);

/// Into the report, with warnings.
void report_changes(const CellChanges& changes, SolveReport& report);

/// What conditions hold, and with what forces, into the report.
/// @param gradient  at u, whose part along the kept directions they balance
void report_constraints(const Constraints& constraints, const Scene& scene, const NodeVector& u,
                        const NodeVector& gradient, SolveReport& report);

/// The points of each condition, at rest and moved.
void add_condition_points(const Constraints& constraints, const Mesh& mesh, const NodeVector& u,
                          std::vector<hexmesh::ConditionPoints>& conditions);

/// Say how many cells of `level` were left out as islands.
void warn_of_dropped_cells(const hexmesh::Lattice& whole, int level, SolveReport& report);

/// The vectors of a field, node by node.
std::vector<Vec3> to_points(const NodeVector& u);

/// Add to each effect the seconds that the problem's terms took for it.
void add_effect_seconds(const LevelProblem& problem, SolveReport& report);

}  // namespace hexsolver
