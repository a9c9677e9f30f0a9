// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "cli/tool.h"
#include "hexsolver/equilibrium/equilibrium.h"
#include "report/solution_json.h"
#include "report/solve_work.h"

namespace hextools {

/// Tells each Newton step; not to be called after the console's end.
hexsolver::SolveProgress progress_on(const Console& console, SolveWork work = {});

/// What the file of a result that is not converged holds: "; 'OUTPUT' holds ..., marked so".
std::string what_is_kept(const hexsolver::SolveReport& report, const std::string& output);

/// In a few lines for people.
void summarize(const hexsolver::SolveReport& report, const Console& console);

}  // namespace hextools
