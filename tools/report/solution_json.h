// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include "hexsolver/plan/plan.h"
#include "hexsolver/report/report.h"
#include "hexsolver/scene/scene.h"

namespace hextools {

double megabytes(std::size_t bytes);

/// Parts of the report.
nlohmann::json to_json(const hexsolver::ConditionReport& condition);
nlohmann::json to_json(const std::vector<hexsolver::ForceReport>& forces);
nlohmann::json to_json(const std::vector<hexsolver::ContactReport>& contacts);
nlohmann::json to_json(const std::vector<hexsolver::MatchReport>& matches);
nlohmann::json to_json(const std::vector<hexsolver::Effect>& effects);

/// The report as the result file keeps it: the same for two runs of the same command.
nlohmann::json to_json(const hexsolver::SolveReport& report, const hexsolver::Scene& scene);

/// What differs from run to run, as the result file keeps it beside the report.
nlohmann::json costs_of(const hexsolver::SolveReport& report, double read_seconds);

/// Likewise into a report that is not part of the result file.
void add_costs(nlohmann::json& out, const hexsolver::SolveReport& report);

/// What a scene selects.
nlohmann::json to_json(const hexsolver::SceneCheck& check);

/// The report of its preview, with what pictures of the scene show: which conditions move their points, and where
/// obstacles are at the end.
nlohmann::json preview_json(const hexsolver::SceneCheck& check, const hexsolver::Scene& scene);

/// What a solution is expected to cost.
nlohmann::json to_json(const hexsolver::SolvePlan& plan);

}  // namespace hextools
