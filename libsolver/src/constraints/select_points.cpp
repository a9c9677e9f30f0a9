// SPDX-License-Identifier: Apache-2.0
#include "constraints/select_points.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hexsolver {

namespace {

/// Whether a condition acts on the area of faces: not on points, nor by the paper's rule; nor where it holds some axes
/// only, as planes of symmetry do, for which the centres of a line of faces may stand.
bool acts_on_area(const Condition& condition, const Scene& scene) {
  const auto& balls = condition.selection.balls;
  return scene.rule_of_supports() != Supports::points && condition.axes == std::array{true, true, true} &&
         std::none_of(balls.begin(), balls.end(), [](const Ball& ball) { return ball.radius == 0; });
}

/// Of points of faces how many are in the same place, where some are soft.
void count_alike(std::vector<ConstraintPoint>& points) {
  if (std::none_of(points.begin(), points.end(), [](const ConstraintPoint& p) { return p.is_soft; })) return;
  std::vector<ConstraintPoint*> of_faces;
  for (ConstraintPoint& p : points)
    if (p.area > 0) of_faces.push_back(&p);
  const auto before = [](const ConstraintPoint* a, const ConstraintPoint* b) {
    if (a->cell != b->cell) return a->cell < b->cell;
    return std::lexicographical_compare(a->weights.begin(), a->weights.end(), b->weights.begin(), b->weights.end());
  };
  std::sort(of_faces.begin(), of_faces.end(), before);
  for (auto first = of_faces.begin(); first != of_faces.end();) {
    const auto end = std::upper_bound(first, of_faces.end(), *first, before);
    for (auto p = first; p != end; ++p) (*p)->num_alike = static_cast<int>(end - first);
    first = end;
  }
}

}  // namespace

std::vector<ConstraintPoint> select_points(const Scene& scene, Selector& selector) {
  std::vector<ConstraintPoint> points;
  for (std::size_t c = 0; c < scene.conditions.size(); ++c) {
    const Condition& condition = scene.conditions[c];
    const std::string what = with_place("condition", condition);
    for (const SurfacePoint& p : selector.select(condition.selection, what)) {
      ConstraintPoint point{static_cast<std::int32_t>(c), p.cell, p.weights, condition.by, condition.axes};
      if (acts_on_area(condition, scene)) {
        point.area = p.area.norm();
        point.is_soft = point.area > 0 && scene.rule_of_supports() == Supports::soft && selector.level_of(p) > 0;
      }
      if (point.area == 0 || selector.has_small_faces()) {
        points.push_back(point);
        continue;
      }
      point.area /= 4;
      point.is_quarter = true;
      for (const NodeWeights& weights : selector.gauss_points(p)) {
        point.weights = weights;
        points.push_back(point);
      }
    }
  }
  count_alike(points);
  return points;
}

Vec3 prescribed_displacement(const Scene& scene, const Mesh& mesh, const ConstraintPoint& point,
                             const Progress& progress) {
  const Condition& condition = scene.conditions[static_cast<std::size_t>(point.condition)];
  const Vec3 at = condition.turn ? mesh.rest_position(point.cell, point.weights) : Vec3::Zero();
  return prescribed_displacement(condition, at, progress);
}

void add_matched_points(const MatchedPoints& matched, std::vector<ConstraintPoint>& points) {
  for (const std::vector<SurfacePoint>& of_one : matched)
    for (const SurfacePoint& p : of_one)
      if (p.cell >= 0) points.push_back({0, p.cell, p.weights});
}

double largest_turning_step(const Scene& scene) {
  double step = 1;
  for (const Condition& c : scene.conditions)
    if (c.turn && c.turn->radians != 0) step = std::min(step, std::numbers::pi / 2 / std::abs(c.turn->radians));
  return step;
}

}  // namespace hexsolver
