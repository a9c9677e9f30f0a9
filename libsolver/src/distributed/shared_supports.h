// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "distributed/shared_level.h"

namespace hexsolver::mpi {

/// Look for motions of the body's parts that supports leave free, as hexsolve does. Called by all processes at once.
/// @param points  held, of all processes
/// @throws SharedError{geometry} of missing supports
void check_supports(const SharedLevel& level, const std::vector<SharedConstraints::Point>& points);

}  // namespace hexsolver::mpi
