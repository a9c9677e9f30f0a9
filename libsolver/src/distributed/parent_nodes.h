// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "distributed/node_subdomain.h"
#include "hexmesh/lattice/merge.h"
#include "mesh/mesh.h"

namespace hexsolver::mpi {

/// Of the cells that those of one process merge into.
struct ParentNodes {
  hexmesh::NodeNumbering numbering;
  std::vector<NodeName> names;  ///< of each node
};

/// Places and numbers of the parents of a merge among all at one index of the whole, with names for their corners.
/// @param low  index of the parents' (0, 0, 0) in the whole
std::vector<NodeName> names_of_parents(const hexmesh::Merge& merge, const Index3& low);

/// Nodes for parents as hexmesh::number_parent_nodes() finds them for the whole body: parents of several processes
/// share one where both pass it on to one fine node, and small parts are tied. All children of a parent are on one
/// process. Called by all at once.
/// @param low   index of the parents' (0, 0, 0) in the whole
/// @param part  of the fine mesh
ParentNodes number_shared_parent_nodes(const Processes& all, const Mesh& fine, const hexmesh::Merge& merge,
                                       const Index3& low, const NodeSubdomain& part);

}  // namespace hexsolver::mpi
