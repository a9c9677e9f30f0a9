// SPDX-License-Identifier: Apache-2.0
#include "dynamics/check_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "dynamics/time_integrator.h"
#include "level/checks.h"

namespace hexsolver {

std::vector<std::string> check_motion(LevelProblem& problem, const NodeVector& u, const Progress& now) {
  const Scene& scene = problem.scene();
  const double duration = scene.dynamics->duration;
  std::vector<std::string> warnings;
  constexpr std::size_t most_times = 100;
  constexpr double jump = 1;  // mm
  const auto add = [&](const std::vector<std::string>& more) {
    for (const std::string& w : more)
      if (std::find(warnings.begin(), warnings.end(), w) == warnings.end()) warnings.push_back(w);
  };
  std::set<double> times = {duration};
  for (const Condition& c : scene.conditions)
    if (c.history)
      for (const History::Row& row : c.history->rows)
        if (row.time < duration && times.size() < most_times) times.insert(row.time);
  for (const double t : times) {
    problem.set_progress({std::min(1.0, t / duration), t});
    add(check_conflicts(problem.constraints(), problem.level(), scene));
  }
  problem.set_progress(now);
  add(check_contacts_at(problem, u));
  std::vector<double> miss(scene.conditions.size());
  for (const ConstraintPoint& p : problem.constraints().points()) {
    double& worst = miss[static_cast<std::size_t>(p.condition)];
    const Vec3 off = p.value - problem.constraints().displacement(p, u);
    for (int d = 0; d < 3; ++d)
      if (p.axes[static_cast<std::size_t>(d)]) worst = std::max(worst, std::abs(off[d]));
  }
  for (std::size_t c = 0; c < miss.size(); ++c)
    if (miss[c] > jump)
      add(
          {fmt::format("condition '{}' ({}) puts points {:.3g} mm from where the start has them: they jump there in "
                       "the first step",
                       scene.conditions[c].name, scene.conditions[c].where, miss[c])});
  return warnings;
}

std::vector<std::string> TimeIntegrator::check() { return check_motion(problem_, u_, progress()); }

const std::string* TimeIntegrator::ball_inside() const {
  for (std::size_t c = 0; c < problem_.contacts().size(); ++c)
    if (problem_.contacts()[c]->state(u_).is_inside) return &scene_.contacts[c].name;
  return nullptr;
}

}  // namespace hexsolver
