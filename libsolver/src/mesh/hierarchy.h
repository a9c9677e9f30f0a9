// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "mesh/prolongation.h"

namespace hexsolver {

/// The geometry of all multigrid levels below a mechanical level: made once, used by every Newton step.
struct Hierarchy {
  std::vector<Mesh> meshes;                 ///< [0] = the mechanical level
  std::vector<hexmesh::Merge> merges;       ///< [l]: cells of meshes[l] -> cells of meshes[l + 1]
  std::vector<Prolongation> prolongations;  ///< [l]: meshes[l + 1] -> meshes[l]
  bool in_double = false;                   ///< V-cycles in double precision, for stiffnesses too far apart for single

  /// @param coarsest_dofs  merge until a level has at most this many; up to Multigrid::most_dense a dense factor is
  /// made
  Hierarchy(Mesh finest, const Vec3& corner, std::size_t coarsest_dofs = usual_coarsest_dofs);
  static constexpr std::size_t usual_coarsest_dofs = 600;

  std::size_t bytes() const;  ///< of memory
};

}  // namespace hexsolver
