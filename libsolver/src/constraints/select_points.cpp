// SPDX-License-Identifier: Apache-2.0
#include "constraints/select_points.h"

#include <fmt/format.h>

namespace hexsolver {

std::vector<ConstraintPoint> select_points(const Scene& scene, Selector& selector) {
  std::vector<ConstraintPoint> points;
  for (std::size_t c = 0; c < scene.conditions.size(); ++c) {
    const Condition& condition = scene.conditions[c];
    const std::string what = fmt::format("condition '{}' ({})", condition.name, condition.where);
    for (const SurfacePoint& p : selector.select(condition.selection, what))
      points.push_back({static_cast<std::int32_t>(c), p.cell, p.weights, condition.by, condition.axes});
  }
  return points;
}

}  // namespace hexsolver
