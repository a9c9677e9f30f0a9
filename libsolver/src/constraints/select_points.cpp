// SPDX-License-Identifier: Apache-2.0
#include "constraints/select_points.h"

#include <fmt/format.h>

#include <algorithm>

namespace hexsolver {

namespace {

/// Whether a condition acts on the area of faces: not on points, nor by the paper's rule.
bool acts_on_area(const Condition& condition, const Scene& scene) {
  const auto& balls = condition.selection.balls;
  return scene.supports == Supports::area &&
         std::none_of(balls.begin(), balls.end(), [](const Ball& ball) { return ball.radius == 0; });
}

}  // namespace

std::vector<ConstraintPoint> select_points(const Scene& scene, Selector& selector) {
  std::vector<ConstraintPoint> points;
  for (std::size_t c = 0; c < scene.conditions.size(); ++c) {
    const Condition& condition = scene.conditions[c];
    const std::string what = fmt::format("condition '{}' ({})", condition.name, condition.where);
    for (const SurfacePoint& p : selector.select(condition.selection, what)) {
      const ConstraintPoint point{static_cast<std::int32_t>(c),
                                  p.cell,
                                  p.weights,
                                  condition.by,
                                  condition.axes,
                                  acts_on_area(condition, scene) ? p.area.norm() : 0};
      if (point.face_area == 0) {
        points.push_back(point);
        continue;
      }
      for (const NodeWeights& weights : selector.gauss_points(p)) {
        points.push_back(point);
        points.back().weights = weights;
      }
    }
  }
  return points;
}

}  // namespace hexsolver
