// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/lattice/lattice.h"

namespace hexmesh {

/// Counts, in every cell of every level, the pieces into which its material falls inside the cell: two voxels of a cell
/// hang together if they share a node, as they do at level 0, or through other voxels of the cell. A cell of more than
/// one piece joins what may not move together: an airway wall and the next, the two arms of a C.
///
/// Where the lattice keeps parts apart only those are joined that hang together close by, and crumbs (see Parting).
///
/// Sets Level::parts; 65535 stands for that many or more.
void count_parts(Lattice& lattice);

}  // namespace hexmesh
