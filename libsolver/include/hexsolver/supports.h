// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hexsolver/constraints.h"

namespace hexsolver {

/// A part of the body and the rigid motions that the supports leave it.
struct FreePart {
  std::vector<std::string> motions;  ///< in words
  std::vector<std::int32_t> cells;
  bool is_island = false;  ///< no point of it is held
  bool hangs = false;      ///< on another part by an edge or a corner
};

/// The parts that the prescribed displacements do not hold; empty where the body is held.
///
/// Cells hang together through faces; parts that only share edges or corners are joined by hinges and ball joints, and
/// count as parts of their own. Free motions are the null space of all supports and joints on the rigid motions of all
/// parts.
std::vector<FreePart> free_parts(const Mesh& mesh, const std::vector<ConstraintPoint>& points);

}  // namespace hexsolver
