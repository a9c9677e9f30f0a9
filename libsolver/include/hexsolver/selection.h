// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hexsolver/constraints.h"
#include "hexsolver/scene.h"

namespace hexsolver {

/// The points that each condition of the scene selects, embedded in the cells of the mechanical level.
/// @param lattice  with its voxels; its level `level` is the mesh
/// @throws Error{geometry} naming a condition that selects nothing, with the distance
/// @throws Error{input} for a segment that the lattice does not have
std::vector<ConstraintPoint> select_points(const Scene& scene, const hexmesh::Lattice& lattice, int level,
                                           const Mesh& mesh);

}  // namespace hexsolver
