// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "level/level_problem.h"
#include "level/on_level.h"

namespace hexsolver {

/// Where a motion begins.
struct StartState {
  NodeVector displacement;  ///< [mm]
  NodeVector velocity;      ///< [mm/s]; empty: none
};

/// The last state of a result, on the nodes of a level of the same lattice.
/// @param on_level  of a graded level, else null
/// @throws Error{input} for a result of another lattice or level, or of a body that is not at rest on the lattice
StartState read_start_state(const std::filesystem::path& result, const LevelProblem& problem, const OnLevel* on_level);

}  // namespace hexsolver
