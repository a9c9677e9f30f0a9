// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "mesh/mesh_cells.h"
#include "mesh/prolongation.h"
#include "mesh/subdomain.h"

namespace hexsolver {

/// The geometry of all multigrid levels below a mechanical level: made once, used by every Newton step.
///
/// Of a body that several processes have, the first levels hold the cells of one of them, and those below the whole.
struct Hierarchy {
  std::vector<Mesh> meshes;                 ///< [0] = the mechanical level
  std::vector<hexmesh::Merge> merges;       ///< [l]: cells of meshes[l] -> cells of meshes[l + 1]
  std::vector<Prolongation> prolongations;  ///< [l]: meshes[l + 1] -> meshes[l]
  /// [l]: with what other processes have of level l; from subdomains.size() on each has the whole. Prolongations and
  /// merges between are of own cells: children of other processes' parents are missing.
  std::vector<std::unique_ptr<const Subdomain>> subdomains;
  bool in_double = false;  ///< V-cycles in double precision, for stiffnesses too far apart for single

  /// @param coarsest_dofs  merge until a level has at most this many; up to Multigrid::most_dense a dense factor is
  /// made
  Hierarchy(Mesh finest, const Vec3& corner, std::size_t coarsest_dofs = usual_coarsest_dofs);
  /// Graded cells merge size by size until they are alike.
  explicit Hierarchy(const MeshCells& cells, std::size_t coarsest_dofs = usual_coarsest_dofs);
  static constexpr std::size_t usual_coarsest_dofs = 600;

  /// Of one level so far.
  explicit Hierarchy(Mesh finest) { meshes.push_back(std::move(finest)); }

  /// Merge the last of the levels there are, whose cells are alike, and so on, until one has at most so many degrees of
  /// freedom.
  void add_coarser(const Vec3& corner, std::size_t coarsest_dofs);

  void push_coarser(Mesh coarse, hexmesh::Merge merge);  ///< a level into which the last one merges

  /// Null where this process has the whole level.
  const Subdomain* subdomain(std::size_t level) const {
    return level < subdomains.size() ? subdomains[level].get() : nullptr;
  }

  /// Whether the mechanical level is so small that a factor of its own matrix solves it: there is no other level but,
  /// where several processes have parts of it, itself as a whole.
  bool is_solved_at_once() const noexcept {
    const bool is_only_gathered =
        meshes.size() == 2 && subdomain(0) && !subdomain(1) && merges[0].factor == Index3{1, 1, 1};
    return meshes.size() == 1 || is_only_gathered;
  }

  std::size_t bytes() const;  ///< of memory
};

/// Of the cells that those of a mesh merge into.
inline Mat3 coarser_edges(const Mesh& fine, const Index3& factor) {
  return fine.edges() * Vec3(factor[0], factor[1], factor[2]).asDiagonal();
}

}  // namespace hexsolver
