// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cli/run_files.h"
#include "hexsolver/plan/plan.h"

namespace hextools {

/// What each condition selects and whether every part is held: --check.
/// @param report  gets it as JSON, or nullptr; on standard output in place of the text
/// @returns the exit code
int show_check(const hexsolver::SceneCheck& check, Output* report, RunFiles& files, const Console& console);

/// Which effects are on and what the solution is expected to cost: --plan. Likewise.
int show_plan(const hexsolver::SolvePlan& plan, Output* report, RunFiles& files);

}  // namespace hextools
