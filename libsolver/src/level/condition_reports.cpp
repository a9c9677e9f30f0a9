// SPDX-License-Identifier: Apache-2.0
#include "level/condition_reports.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace hexsolver {

std::vector<ConditionReport> report_points(const Constraints& constraints, const Scene& scene) {
  std::vector<ConditionReport> out;
  for (const Condition& c : scene.conditions) out.push_back({c.name, 0, 0, 0, Vec3::Zero()});
  for (const ConstraintPoint& p : with_face_centers(constraints.points()))
    ++out[static_cast<std::size_t>(p.condition)].points;
  const std::vector<std::size_t> kept = constraints.kept_by_condition(out.size());
  for (std::size_t c = 0; c < kept.size(); ++c) out[c].kept = kept[c];
  return out;
}

std::vector<Vec3> reactions(const Constraints& constraints, const Scene& scene, const NodeVector& u,
                            const NodeVector& gradient) {
  std::vector<Vec3> out(scene.conditions.size(), Vec3::Zero());
  const std::vector<Vec3> forces = constraints.forces(gradient, u);
  for (std::size_t p = 0; p < forces.size(); ++p)
    out[static_cast<std::size_t>(constraints.held()[p].condition)] += forces[p];
  return out;
}

void report_constraints(const Constraints& constraints, const Scene& scene, const Mesh& mesh, const NodeVector& u,
                        const NodeVector& gradient, const Arms& arms, SolveReport& report) {
  report.conditions = report_points(constraints, scene);
  for (const ConstraintPoint& p : with_face_centers(constraints.points())) {
    ConditionReport& r = report.conditions[static_cast<std::size_t>(p.condition)];
    Vec3 miss = p.value - constraints.displacement(p, u);
    for (int d = 0; d < 3; ++d)
      if (!p.axes[static_cast<std::size_t>(d)]) miss[d] = 0;
    r.misfit_mm = std::max(r.misfit_mm, miss.norm());
  }
  const std::vector<Vec3> forces = constraints.forces(gradient, u);
  for (std::size_t n = 0; n < forces.size(); ++n) {
    const ConstraintPoint& p = constraints.held()[n];
    ConditionReport& r = report.conditions[static_cast<std::size_t>(p.condition)];
    r.reaction_n += forces[n];
    r.moment_n_mm += arms.of(mesh.rest_position(p.cell, p.weights), constraints.displacement(p, u)).cross(forces[n]);
  }
  report.kept_directions = constraints.num_kept();
  report.constraint_violation_mm = constraints.violation(u);
  // What is known to be off at the conditions is part of the error.
  if (std::optional<double>& largest = report.levels.back().error.max_mm)
    for (const ConditionReport& c : report.conditions) largest = std::max(*largest, c.misfit_mm);
}

void add_condition_points(const Constraints& constraints, const Mesh& mesh, const NodeVector& u,
                          std::vector<hexmesh::ConditionPoints>& conditions) {
  for (const ConstraintPoint& p : with_face_centers(constraints.points())) {
    hexmesh::ConditionPoints& condition = conditions[static_cast<std::size_t>(p.condition)];
    condition.points.push_back(mesh.rest_position(p.cell, p.weights));
    condition.displacement.push_back(constraints.displacement(p, u));
  }
}

}  // namespace hexsolver
