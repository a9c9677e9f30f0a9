// SPDX-License-Identifier: Apache-2.0
#include "report/solve_work.h"

#include <algorithm>
#include <cmath>

namespace hextools {

SolveWork work_of(const hexmesh::Lattice& lattice, const hexsolver::Scene& scene, int finest) {
  constexpr double usual_of_auto = 1e-3;
  SolveWork work{{}, finest, scene.finds_tolerance ? usual_of_auto : scene.tolerance};
  if (!scene.is_open_ended())
    for (const hexmesh::Level& level : lattice.levels) work.cells.push_back(level.cells.size());
  return work;
}

std::optional<double> part_done(const SolveWork& work, int level, double load, double residual) {
  if (work.cells.empty() || level < work.finest || !std::isfinite(residual)) return {};
  const double fallen = std::clamp(std::log(residual) / std::log(work.tolerance), 0.0, 1.0);
  double done = 0, all = 0;
  for (int n = work.finest; n < std::ssize(work.cells); ++n) {
    const auto cells = static_cast<double>(work.cells[static_cast<std::size_t>(n)]);
    all += cells;
    if (n > level) done += cells;
    if (n == level) done += cells * load * fallen;
  }
  return done / all;
}

}  // namespace hextools
