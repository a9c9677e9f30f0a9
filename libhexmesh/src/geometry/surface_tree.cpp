// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/geometry/surface_tree.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <numeric>
#include <unsupported/Eigen/BVH>

namespace hexmesh {

/// Ericson, Real-Time Collision Detection (2005), section 5.1.5.
Foot nearest_in(const Triangle& t, const Vec3& place) {
  const Vec3 ab = t[1] - t[0], ac = t[2] - t[0], ap = place - t[0], bp = place - t[1], cp = place - t[2];
  const double d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp), d6 = ac.dot(cp);
  const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
  const auto part = [](double a, double b) { return a + b > 0 ? a / (a + b) : 0; };  // of edges without length
  const auto foot = [&](double b, double c) {
    Foot f;
    f.weights = {1 - b - c, b, c};
    f.place = t[0] + b * ab + c * ac;
    f.distance = (place - f.place).norm();
    return f;
  };
  if (d1 <= 0 && d2 <= 0) return foot(0, 0);
  if (d3 >= 0 && d4 <= d3) return foot(1, 0);
  if (d6 >= 0 && d5 <= d6) return foot(0, 1);
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return foot(part(d1, -d3), 0);
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return foot(0, part(d2, -d6));
  if (va <= 0 && d4 >= d3 && d5 >= d6) {
    const double c = part(d4 - d3, d5 - d6);
    return foot(1 - c, c);
  }
  const double sum = va + vb + vc;
  if (sum > 1e-12 * ab.squaredNorm() * ac.squaredNorm()) return foot(vb / sum, vc / sum);
  // Without an area: the nearest of the three edges.
  const auto along = [](const Vec3& from, const Vec3& to) {
    return to.squaredNorm() > 0 ? std::clamp(from.dot(to) / to.squaredNorm(), 0.0, 1.0) : 0.0;
  };
  const double c = along(bp, t[2] - t[1]);
  Foot best = foot(along(ap, ab), 0);
  for (const Foot& other : {foot(0, along(ap, ac)), foot(1 - c, c)})
    if (other.distance < best.distance) best = other;
  return best;
}

struct SurfaceTree::Boxes {
  using Box = Eigen::AlignedBox3d;
  Eigen::KdBVH<double, 3, std::size_t> tree;
};

namespace {

/// What Eigen's search asks: squared distances of boxes and triangles.
struct Search {
  using Scalar = double;
  const SurfaceTree& surface;
  const Vec3& place;
  double least = std::numeric_limits<double>::infinity();
  Foot best = {};

  double minimumOnVolume(const Eigen::AlignedBox3d& box) const {
    const double d = box.squaredExteriorDistance(place);
    return d <= least ? d : std::numeric_limits<double>::infinity();  // nothing there that matters
  }
  double minimumOnObject(std::size_t triangle) {
    Foot foot = nearest_in(surface.corners(triangle), place);
    const double d = foot.distance * foot.distance;
    // Of triangles that share the foot the one with the lowest number, whatever order they come in.
    if (d < least || (d == least && triangle < best.triangle)) {
      foot.triangle = triangle;
      best = foot;
      least = d;
    }
    return d;
  }
};

}  // namespace

SurfaceTree::SurfaceTree(std::span<const Vec3> points, std::span<const std::array<std::int32_t, 3>> triangles)
    : points_(points), triangles_(triangles), boxes_(std::make_unique<Boxes>()) {
  std::vector<std::size_t> numbers(triangles.size());
  std::iota(numbers.begin(), numbers.end(), std::size_t{0});
  std::vector<Boxes::Box> boxes;
  boxes.reserve(numbers.size());
  for (const std::size_t t : numbers) {
    const Triangle c = corners(t);
    boxes.push_back(Boxes::Box(c[0]).extend(c[1]).extend(c[2]));
  }
  boxes_->tree.init(numbers.begin(), numbers.end(), boxes.begin(), boxes.end());
}

SurfaceTree::~SurfaceTree() = default;

Triangle SurfaceTree::corners(std::size_t triangle) const {
  const auto& t = triangles_[triangle];
  return {points_[as_size(t[0])], points_[as_size(t[1])], points_[as_size(t[2])]};
}

Vec3 SurfaceTree::normal(std::size_t triangle) const {
  const Triangle c = corners(triangle);
  return (c[1] - c[0]).cross(c[2] - c[0]);
}

Foot SurfaceTree::nearest(const Vec3& place, std::size_t guess) const {
  Search search{*this, place};
  search.minimumOnObject(guess);
  Eigen::BVMinimize(boxes_->tree, search);
  return search.best;
}

std::vector<double> areas_of_points(std::span<const Vec3> points,
                                    std::span<const std::array<std::int32_t, 3>> triangles) {
  std::vector<double> out(points.size());
  for (const auto& t : triangles) {
    const Vec3& a = points[as_size(t[0])];
    const double area = (points[as_size(t[1])] - a).cross(points[as_size(t[2])] - a).norm() / 2;
    for (const std::int32_t corner : t) out[as_size(corner)] += area / 3;
  }
  return out;
}

}  // namespace hexmesh
