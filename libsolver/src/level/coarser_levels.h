// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hexmesh/lattice/lattice.h"
#include "hexsolver/scene/scene.h"

namespace hexsolver {

/// Cells of each level of a lattice.
std::vector<std::size_t> cells_of_levels(const hexmesh::Lattice& lattice);

/// The scene for levels coarser than the mechanical one: their lattice nodes are other points, faces stand for them.
Scene for_coarser_levels(Scene scene);

/// The coarsest level that a solution on `finest` starts from.
int first_nested_level(const std::vector<std::size_t>& num_cells, int finest);

}  // namespace hexsolver
