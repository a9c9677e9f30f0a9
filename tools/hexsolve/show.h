// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexsolver/plan/plan.h"
#include "options.h"

namespace hextools {

/// What each condition selects and whether every part is held: --check. @returns the exit code
int show_check(const hexsolver::SceneCheck& check, const SolveOptions& o, const CommonOptions& common,
               const Console& console);

/// Which effects are on and what the solution is expected to cost: --plan. @returns the exit code
int show_plan(const hexsolver::SolvePlan& plan, const SolveOptions& o, const CommonOptions& common);

}  // namespace hextools
