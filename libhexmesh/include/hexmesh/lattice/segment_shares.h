// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "hexmesh/lattice/lattice.h"

namespace hexmesh {

/// What of an element, or of a cell, is one segment's.
struct SegmentShare {
  double volume = 0;  ///< of its filled part, in [0, 1]
  double shear = 0;   ///< of int mu dV, in [0, 1]
};

/// Of each element of a level; shape (num_elements).
/// @pre the children of all levels up to that one are there
std::vector<SegmentShare> shares_of_segment(const Lattice& lattice, int level, std::uint16_t label);

}  // namespace hexmesh
