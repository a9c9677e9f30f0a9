// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>
#include <vector>

#include "hexmesh/lattice/lattice.h"
#include "hexmesh/tetra/tet_mesh.h"

namespace hexmesh {

/// How long the edges of tetrahedra may get.
struct TetSizes {
  double size = 10;  ///< [mm]
  struct Finer {
    Vec3 center;    ///< [mm]
    double radius;  ///< [mm]
    double size;    ///< within the radius [mm]; beyond it grows by half of the distance
  };
  std::vector<Finer> finer;  ///< around supports

  double at(const Vec3& position) const;
};

/// Tetrahedra of the material of a lattice's voxels, for comparison, by CGAL's Delaunay refinement.
///
/// The surface is where the voxels' indicator, smoothed by a Gaussian of one voxel, has the value that keeps the
/// volume; segments part where theirs are equal. The same for every call: one thread, a fixed seed, no time limit.
/// Source: Jamin, Alliez, Yvinec, Boissonnat, "CGALmesh", ACM Trans. Math. Softw. 41 (2015) 23.
/// @throws Error{input} where nothing is left of the body at that size
TetMesh mesh_body(const Lattice& lattice, const TetSizes& sizes);

}  // namespace hexmesh
