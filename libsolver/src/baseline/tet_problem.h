// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hexmesh/lattice/lattice.h"
#include "hexmesh/tetra/tet_mesh.h"
#include "hexsolver/scene/scene.h"

namespace hexsolver {

/// A scene on tetrahedra: what is prescribed and what pulls, node by node.
struct TetProblem {
  const hexmesh::TetMesh* mesh = nullptr;    ///< must outlive this
  std::vector<hexmesh::Material> materials;  ///< of each tetrahedron
  std::vector<std::array<bool, 3>> held;     ///< of each node, which components
  std::vector<Vec3> prescribed;              ///< of each node [mm]
  std::vector<Vec3> force;                   ///< of each node: forces, pressure and weight [N]
  std::vector<double> mass;                  ///< of each node, lumped [tonne]
  std::vector<std::size_t> points;           ///< nodes that each condition selects
};

/// Conditions hold the nodes of the surface that their selections contain, as finite elements do; a ball that contains
/// none takes the nearest.
/// @param lattice  names the segments' materials; tetrahedra without a segment are of its only material
/// @throws Error{usage} for what tetrahedra know nothing of: obstacles, segments beside which a condition acts,
/// histories
/// @throws Error{geometry} for a selection without nodes
TetProblem make_tet_problem(const hexmesh::TetMesh& mesh, const hexmesh::Lattice& lattice, const Scene& scene);

/// How far apart nodes near supports must at most be for patches to have the shape that is asked [mm], with edges of at
/// most `size` elsewhere: for hexmesh::TetSizes.
double size_at_supports(const Scene& scene, double size);

}  // namespace hexsolver
