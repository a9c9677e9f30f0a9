// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hexmesh/lattice/lattice.h"
#include "hexsolver/report/report.h"
#include "hexsolver/scene/scene.h"

namespace hexsolver {

/// Cells of each level of a lattice.
std::vector<std::size_t> cells_of_levels(const hexmesh::Lattice& lattice);

/// The scene for levels coarser than the mechanical one: their lattice nodes are other points, faces stand for them.
Scene for_coarser_levels(Scene scene);

/// The coarsest level that a solution on `finest` starts from.
int first_nested_level(const std::vector<std::size_t>& num_cells, int finest);

/// What a next level of so many cells is expected to take [s]: a power of its cells, that of the last two levels. Small
/// levels take time whatever their size, so that each of the next ones is dearer by less than its cells tell.
/// @param solved  coarse to fine, at least one
double expected_seconds(const std::vector<LevelReport>& solved, std::size_t cells);

}  // namespace hexsolver
