// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "hexmesh/geometry/solid.h"
#include "hexmesh/result/result.h"

namespace hexmesh {

/// What the surface stays out of, without friction, where it is at the end.
struct DeckObstacle {
  Solid solid;
  double stiffness = 0;  ///< of the spring of each surface point inside it [N/mm]; 0: hard
};

/// Write the model of a result as an input deck of CalculiX (and of other programs that read Abaqus decks): voxels as
/// C3D8, each segment its elastic material, conditions on lattice nodes as prescribed displacements, forces and gravity
/// as forces on nodes, one static step of small strain. Units mm, N, MPa.
///
/// The centre of each outer face within two voxels of an obstacle in the result is a node of its own, the mean of the
/// face's corners (*EQUATION), with a gap (GAPUNI) along the normal that the obstacle has for it in the result. Of a
/// plane that is the contact itself; of others the result meets the same conditions of contact.
/// @throws Error{input} for what such a deck cannot say: partly filled cells, materials that follow grey values,
///   conditions on other points than nodes
void write_calculix_deck(const Result& result, const std::vector<DeckObstacle>& obstacles,
                         const std::filesystem::path& path);

}  // namespace hexmesh
