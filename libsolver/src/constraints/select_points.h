// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "constraints/constraints.h"
#include "selection/selection.h"

namespace hexsolver {

/// The points of all conditions of the scene.
std::vector<ConstraintPoint> select_points(const Scene& scene, Selector& selector);

}  // namespace hexsolver
