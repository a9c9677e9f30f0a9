// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "hexmesh/lattice/merge.h"

namespace hexmesh {

/// Where the material of a cell is, coarsely: the cell in 4 x 4 x 4 subcells, a bit for each that holds some of it.
/// Subcell (i, j, k) is bit i + 4 (j + 4 k). Those of a cell of 4 voxels an edge are its voxels.
using SubcellMask = std::uint64_t;
inline constexpr int subcells_along = 4;
inline constexpr SubcellMask all_subcells = ~SubcellMask{0};

/// Of a parent, from its children: two subcells of a child are one of its parent along axes that are merged.
/// @param of_elements  of the elements of the finer level
SubcellMask subcells_of(const Children& children, const std::vector<SubcellMask>& of_elements, const Index3& merge);

}  // namespace hexmesh
