// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "constraints/supports.h"
#include "hexmesh/lattice/lattice.h"
#include "hexsolver/report/report.h"
#include "hexsolver/scene/scene.h"

namespace hexsolver {

/// Whether all free parts are islands, and not the whole body.
/// Whether what supports leave free may come to rest on obstacles.
bool is_carried_by_contacts(const Scene& scene);

bool only_islands_among(const std::vector<FreePart>& free, const Mesh& mesh);

/// @throws Error{geometry} that tells which motions nothing holds
[[noreturn]] void fail_unsupported(const std::vector<FreePart>& free, const Scene& scene, int level, bool only_islands);

/// Cells of the islands that the scene leaves out: all with "drop", those that touch other parts by an edge or a
/// corner with "hold".
/// @param lattice  with that level
std::vector<std::int32_t> islands_to_leave_out(const hexmesh::Lattice& lattice, const Scene& scene, int level);

/// The lattice without islands_to_leave_out(). Nothing if there are none.
/// @param lattice  with all levels and voxels if there are
/// @param dropped  receives how many cells of `level` they are
std::optional<hexmesh::Lattice> without_islands(const hexmesh::Lattice& lattice, const Scene& scene, int level,
                                                std::size_t& dropped);

/// Say how many cells of `level` were left out as islands.
void warn_of_dropped_cells(const hexmesh::Lattice& whole, int level, SolveReport& report);

}  // namespace hexsolver
