// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "level/level_problem.h"

namespace hexsolver {

/// Warnings, each once. Conditions may be incompatible at any time: at the corners of their tables and at the end.
/// Obstacles and conditions at the start are held against the state that it is.
/// @param problem  of a motion; is at `now` afterwards
/// @param u        at the start
/// @throws Error{geometry} as solve_equilibrium
std::vector<std::string> check_motion(LevelProblem& problem, const NodeVector& u, const Progress& now);

}  // namespace hexsolver
