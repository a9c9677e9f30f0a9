// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "distributed/keys.h"
#include "distributed/processes.h"
#include "mesh/hierarchy.h"

namespace hexsolver::mpi {

/// Merges from a level to the first that every process has the whole of.
struct SharedMerges {
  std::vector<Index3> factors;  ///< level by level, at least one
  Index3 block = {1, 1, 1};     ///< cells that become one by all of them: each block is one process's
};

/// As few merges as leave every process a small level.
/// @param cell_size  [mm]
/// @param num_cells  of the whole body
SharedMerges merges_of_parts(const Vec3& cell_size, std::size_t num_cells, int num_processes);

/// The levels below the part of a mesh that each process has: those of the whole body's hierarchy, as far as `merges`
/// say in parts, then the whole on every process. Called by all at once.
/// @param finest         of the cells of this process
/// @param low            index of its (0, 0, 0) in the whole, a multiple of merges.block
/// @param keys           of its nodes
/// @param corner         position of its node (0, 0, 0) [mm]
/// @param whole_corner   that of the whole's [mm]
/// @param coarsest_dofs  see Hierarchy
Hierarchy make_part_hierarchy(const Processes& all, Mesh finest, const std::vector<Key>& keys, Index3 low,
                              const Vec3& corner, const Vec3& whole_corner, const SharedMerges& merges,
                              std::size_t coarsest_dofs = Hierarchy::usual_coarsest_dofs);

}  // namespace hexsolver::mpi
