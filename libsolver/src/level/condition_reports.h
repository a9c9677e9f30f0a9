// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "constraints/constraints.h"
#include "hexmesh/file/result_file.h"
#include "hexsolver/report/report.h"
#include "hexsolver/scene/scene.h"
#include "level/balance.h"

namespace hexsolver {

/// Points and kept directions of each condition.
std::vector<ConditionReport> report_points(const Constraints& constraints, const Scene& scene);

/// The force of each condition on the body [N].
/// @param gradient  at u, whose part along the kept directions they balance
std::vector<Vec3> reactions(const Constraints& constraints, const Scene& scene, const NodeVector& u,
                            const NodeVector& gradient);

/// What conditions hold, and with what forces, into the report.
/// @param mesh      of the constraints
/// @param gradient  at u, whose part along the kept directions they balance
void report_constraints(const Constraints& constraints, const Scene& scene, const Mesh& mesh, const NodeVector& u,
                        const NodeVector& gradient, const Arms& arms, SolveReport& report);

/// The points of each condition, at rest and moved.
void add_condition_points(const Constraints& constraints, const Mesh& mesh, const NodeVector& u,
                          std::vector<hexmesh::ConditionPoints>& conditions);

}  // namespace hexsolver
