// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hexsolver/scene/scene.h"
#include "mesh/mesh_cells.h"

namespace hexsolver {

/// The cells that a scene is solved with on a level: all of it, or graded ones, whose finest are of that level.
///
/// Graded, a cell is at most as large as h + 4 d, h the size of the finest and d how far its box is from the nearest
/// place where a support or a force ends or an obstacle presses, and at most `Scene::coarser_by` levels coarser.
/// @throws Error{geometry} for selections
MeshCells cells_for(const hexmesh::Lattice& lattice, const Scene& scene, int level);

/// How many these are on each level; 0 of levels that the lattice has no cells of.
std::vector<std::size_t> cells_of_levels(const hexmesh::Lattice& lattice, const Scene& scene);

/// How many cells the error of graded ones is told from, which are these all halved; 0 where it is not.
std::size_t cells_beyond(const hexmesh::Lattice& lattice, const Scene& scene, int level);

}  // namespace hexsolver
