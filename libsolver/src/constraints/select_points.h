// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "constraints/constraints.h"
#include "selection/selection.h"
#include "terms/match_term.h"

namespace hexsolver {

/// The points of all conditions of the scene.
std::vector<ConstraintPoint> select_points(const Scene& scene, Selector& selector);

/// Where a point of a condition is to be [mm].
/// @param mesh  that its cell is of
Vec3 prescribed_displacement(const Scene& scene, const Mesh& mesh, const ConstraintPoint& point,
                             const Progress& progress);

/// How large a part of the load a step may be for what turns: half a turn has two ways there, a quarter one.
double largest_turning_step(const Scene& scene);

/// What a [[match]] pulls is held by that, as if its points were: for the search of what nothing holds.
void add_matched_points(const MatchedPoints& matched, std::vector<ConstraintPoint>& points);

}  // namespace hexsolver
