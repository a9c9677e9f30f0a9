// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "hexmesh/lattice/lattice.h"
#include "hexsolver/report/outcome.h"
#include "hexsolver/scene/scene.h"

namespace hexsolver {

/// Told after every Newton step: level, load fraction, iteration, relative residual, linear iterations of the step.
using SolveProgress = std::function<void(int, double, int, double, int)>;

/// The finest level that a scene may ask for: its level; 0 for an accuracy or a budget; else the finest of at most
/// 20000 cells.
/// @throws Error{input} if the lattice has no such level
int finest_level(const Scene& scene, const hexmesh::Lattice& lattice);
int finest_level(const Scene& scene, const std::vector<std::size_t>& num_cells);  ///< of each level

/// The finest level that an equilibrium of `level` needs of a lattice: the next finer one where its error is told from
/// that.
/// @param num_cells  of each level
int finest_level_needed(const Scene& scene, const std::vector<std::size_t>& num_cells, int level);

/// Whether a solution on that level leaves islands out, which takes all of the lattice: voxels and every level.
/// @param lattice  with that level
/// @throws Error{geometry} for selections
bool leaves_islands_out(const hexmesh::Lattice& lattice, const Scene& scene, int level);

/// Static equilibrium of a lattice under a scene, solved from a coarse level down to `level`, each level starting from
/// the one before; where Newton fails the load is cut back and raised in steps. With an accuracy or a budget it ends
/// at the first level that is good enough, or the last that there was time for.
///
/// The error of a level is estimated from the differences between consecutive levels (THEORY.md, "Accuracy").
/// @param lattice  with its levels from finest_level_needed() up; with all where it leaves_islands_out(). Without the
///                 one finer than `level` errors are estimated from the levels passed
/// @param start    displacement of the level's nodes [mm], to begin with instead of coarser levels; of uniform cells
///                 without islands left out
/// @throws Error{geometry} for selections, incompatible conditions and missing supports, before the level they concern
///                         is solved
/// @throws Error{input} for an accuracy asked of a single point, which has no limit, or of a lattice of one level
Outcome solve_equilibrium(const hexmesh::Lattice& lattice, const Scene& scene, int level,
                          const SolveProgress& progress = {}, const std::vector<Vec3>* start = nullptr);

}  // namespace hexsolver
