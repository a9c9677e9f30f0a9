// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cli/run_files.h"
#include "hexsolver/plan/plan.h"

namespace hextools {

/// What each condition selects and whether every part is held: --check.
/// @param report  gets it as JSON, or nullptr; on standard output in place of the text
/// @param preview  gets the body at rest with what the scene selects, as a result for pictures; or nullptr
/// @param lattice  the file
/// @param history  of the lattice, and this command's
/// @returns the exit code
int show_check(hexsolver::SceneCheck check, const hexsolver::Scene& scene, Output* report, Output* preview,
               const std::filesystem::path& lattice, std::vector<std::string> history, RunFiles& files,
               const Console& console);

/// Which effects are on and what the solution is expected to cost: --plan. Likewise.
int show_plan(const hexsolver::SolvePlan& plan, Output* report, RunFiles& files);

}  // namespace hextools
