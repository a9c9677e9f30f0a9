// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hexsolver/constraints.h"

namespace hexsolver {

/// The rigid motions that the prescribed displacements leave free, in words; empty where the body is held.
///
/// Cells hang together through faces; parts that only share edges or corners are joined by hinges and ball joints, and
/// count as parts of their own. Free motions are the null space of all supports and joints on the rigid motions of all
/// parts.
std::vector<std::string> free_motions(const Mesh& mesh, const std::vector<ConstraintPoint>& points);

}  // namespace hexsolver
