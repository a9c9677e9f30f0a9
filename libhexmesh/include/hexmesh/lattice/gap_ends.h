// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hexmesh/lattice/lattice.h"

namespace hexmesh {

/// Of each cell of a level, shape (num_cells), whether it closes a gap that is open on the next finer level: nodes of
/// that level that are at one place but are not the same are moved alike by it, or by it and another.
/// @pre level > 0; both levels are there
std::vector<bool> cells_where_gaps_end(const Lattice& lattice, int level);

/// The gaps that each level holds open in part: see OpenGaps. All zero where nothing is split, and on the first two
/// levels.
/// @pre all levels are there
void measure_open_gaps(Lattice& lattice);

/// Of each cell of a level, shape (num_cells), whether it has a node at which a gap ends: two cells have that node in
/// common, and one at another place that is not the same.
std::vector<bool> cells_round_gap_ends(const Level& level);

}  // namespace hexmesh
