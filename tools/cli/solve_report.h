// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/tool.h"
#include "hexsolver/dynamics/motion.h"
#include "hexsolver/equilibrium/equilibrium.h"
#include "hexsolver/scene/scene.h"

namespace hextools {

double megabytes(std::size_t bytes);

/// Parts of the report.
nlohmann::json to_json(const hexsolver::ConditionReport& condition);
nlohmann::json to_json(const std::vector<hexsolver::ForceReport>& forces);
nlohmann::json to_json(const std::vector<hexsolver::ContactReport>& contacts);
nlohmann::json to_json(const std::vector<hexsolver::MatchReport>& matches);
nlohmann::json to_json(const std::vector<hexsolver::Effect>& effects);
void add_effect_seconds(nlohmann::json& effects, const std::vector<hexsolver::Effect>& from);

/// The report as the result file keeps it: the same for two runs of the same command.
nlohmann::json to_json(const hexsolver::SolveReport& report, const hexsolver::Scene& scene);

/// What differs from run to run, as the result file keeps it beside the report.
nlohmann::json costs_of(const hexsolver::SolveReport& report, double read_seconds);

/// Likewise into a report that is not part of the result file.
void add_costs(nlohmann::json& out, const hexsolver::SolveReport& report);

/// Adds to a report what pictures of the scene show: which conditions move their points, and where obstacles are at the
/// end.
void add_scene(nlohmann::json& report, const hexsolver::Scene& scene);

/// What a solution has to do, for the share that is done.
struct SolveWork {
  std::vector<std::size_t> cells;  ///< of each level; empty: not known
  int finest = 0;                  ///< level that is solved
  double tolerance = 1e-8;
};

/// Tells each Newton step; not to be called after the console's end.
hexsolver::SolveProgress progress_on(const Console& console, SolveWork work = {});

/// What the file of a result that is not converged holds: "; 'OUTPUT' holds ..., marked so".
std::string what_is_kept(const hexsolver::SolveReport& report, const std::string& output);

/// In a few lines for people.
void summarize(const hexsolver::SolveReport& report, const Console& console);

}  // namespace hextools
