// SPDX-License-Identifier: Apache-2.0
#include "level/balance.h"

#include <Eigen/Geometry>

namespace hexsolver {

BalanceReport::Row resultant(const std::string& name, const NodeVector& forces, const Mesh& mesh, const NodeVector& u,
                             const Arms& arms, const std::vector<bool>& counts) {
  BalanceReport::Row row{name};
  for (std::size_t n = 0; n < mesh.num_nodes(); ++n) {
    if (!counts.empty() && !counts[n]) continue;
    const auto at = 3 * static_cast<Eigen::Index>(n);
    const Vec3 force = forces.segment<3>(at);
    row.force_n += force;
    row.moment_n_mm += arms.of(mesh.position(n), u.segment<3>(at)).cross(force);
  }
  return row;
}

void report_balance(const Scene& scene, const Arms& arms, const std::vector<BalanceReport::Row>& loads,
                    SolveReport& report) {
  BalanceReport& balance = report.balance;
  balance = {arms.about(), {}};
  for (const ConditionReport& c : report.conditions)
    balance.acting.push_back({"condition '" + c.name + "'", c.reaction_n, c.moment_n_mm});
  balance.acting.insert(balance.acting.end(), loads.begin(), loads.end());
  const auto row_of = [&](const std::string& name) {
    for (const BalanceReport::Row& row : loads)
      if (row.name == name) return row;
    return BalanceReport::Row{};
  };
  for (std::size_t n = 0; n < report.forces.size(); ++n)
    report.forces[n].moment_n_mm =
        row_of(n < scene.forces.size() ? load_name(scene.forces[n]) : name_of(EffectKind::gravity)).moment_n_mm;
  for (std::size_t n = 0; n < report.contacts.size(); ++n)
    report.contacts[n].moment_n_mm = row_of(contact_name(scene.contacts[n])).moment_n_mm;
  for (std::size_t n = 0; n < report.matches.size(); ++n) {
    const BalanceReport::Row row = row_of(match_name(scene.matches[n]));
    report.matches[n].force_n = row.force_n;
    report.matches[n].moment_n_mm = row.moment_n_mm;
  }
}

}  // namespace hexsolver
