// SPDX-License-Identifier: Apache-2.0
#include "match/surface_matching.h"

#include <algorithm>
#include <cmath>

#include "match/distances.h"

namespace hexsolver {
namespace {

using hexmesh::Foot;
using hexmesh::SurfaceTree;

/// So many samples of a surface find its shape; more take time.
constexpr std::size_t most_samples = 10'000;
/// Of the stiffness, for what a target that is a part of the surface does not see.
constexpr double of_unseen = 1e-4;

/// Second derivative of half the squared distance from a surface: what moves the foot along does not count.
Mat3 hessian_of_foot(const Foot& foot, const SurfaceTree& surface) {
  const hexmesh::Triangle c = surface.corners(foot.triangle);
  int corners = 0, without = 0;
  for (int n = 0; n < 3; ++n) {
    corners += foot.weights[n] > 0;
    if (foot.weights[n] <= 0) without = n;
  }
  if (corners == 1) return Mat3::Identity();
  if (corners == 2) {
    const auto a = static_cast<std::size_t>((without + 1) % 3), b = static_cast<std::size_t>((without + 2) % 3);
    const Vec3 along = (c[b] - c[a]).normalized();
    return Mat3::Identity() - along * along.transpose();
  }
  const Vec3 normal = surface.normal(foot.triangle).normalized();
  return normal * normal.transpose();
}

/// Feet of many places at once.
/// @param place  number -> place
template <class Place>
std::vector<Foot> feet(const SurfaceTree& tree, std::size_t count, const Place& place) {
  constexpr std::size_t at_once = 64;  // neighbours mostly, of which one's foot is near the next one's
  std::vector<Foot> out(count);
#pragma omp parallel for schedule(dynamic)
  for (std::size_t begin = 0; begin < count; begin += at_once)
    for (std::size_t n = begin; n < std::min(count, begin + at_once); ++n)
      out[n] = tree.nearest(place(n), n > begin ? out[n - 1].triangle : 0);
  return out;
}

}  // namespace

void Pull::reset(std::size_t num_points) {
  energy = 0;
  gradient.assign(num_points, Vec3::Zero());
  hessian.assign(num_points, Mat3::Zero());
  bound.assign(num_points, 0);
}

std::vector<SurfaceMatching::Sample> SurfaceMatching::samples_of(const std::vector<double>& areas) {
  const std::size_t every = std::max<std::size_t>(1, (areas.size() + most_samples - 1) / most_samples);
  std::vector<Sample> out;
  for (std::size_t n = 0; n < areas.size(); n += every)
    if (areas[n] > 0) out.push_back({n, static_cast<double>(every) * areas[n]});
  return out;
}

SurfaceMatching::SurfaceMatching(const Match& match, hexmesh::TriangleSurface body, double stiffness)
    : name_(match.name),
      trust_(match.trust),
      body_(std::move(body)),
      target_(match.target),
      is_partial_(match.is_partial ? *match.is_partial : hexmesh::count_open_edges(target_) > 0),
      outliers_(match.outliers),
      of_body_(stiffness * (is_partial_ ? of_unseen : 0.5)),
      of_target_(stiffness * (is_partial_ ? 1 : 0.5)),
      body_areas_(hexmesh::areas_of_points(body_.points, body_.triangles)),
      target_areas_(hexmesh::areas_of_points(target_.points, target_.triangles)),
      body_samples_(samples_of(body_areas_)),
      target_samples_(samples_of(target_areas_)),
      body_tree_(body_.points, body_.triangles),
      target_tree_(target_.points, target_.triangles) {}

std::pair<double, double> SurfaceMatching::huber(double distance) const {
  if (outliers_ > 0 && distance > outliers_) return {outliers_ * (distance - outliers_ / 2), outliers_ / distance};
  return {distance * distance / 2, 1};
}

void SurfaceMatching::pull(const std::vector<Vec3>& places, const Eigen::Isometry3d& pose, Pull& out) const {
  out.reset(places.size());
  if (is_partial_)
    hold(places, pose, out);
  else
    pull_body(places, out);
  pull_to_target(places, out);
}

void SurfaceMatching::hold(const std::vector<Vec3>& places, const Eigen::Isometry3d& pose, Pull& out) const {
  for (const auto& [point, area] : body_samples_) {
    const Vec3 away = places[point] - pose * body_.points[point];
    out.energy += of_body_ * area * away.squaredNorm() / 2;
    out.gradient[point] += of_body_ * area * away;
    out.hessian[point] += of_body_ * area * Mat3::Identity();
    out.bound[point] += of_body_ * area;
  }
}

void SurfaceMatching::pull_body(const std::vector<Vec3>& places, Pull& out) const {
  const std::vector<Foot> found =
      feet(target_tree_, body_samples_.size(), [&](std::size_t n) { return places[body_samples_[n].point]; });
  for (std::size_t n = 0; n < found.size(); ++n) {
    const auto& [point, area] = body_samples_[n];
    const auto [energy, slope] = huber(found[n].distance);
    const Vec3 away = places[point] - found[n].place;
    Mat3 hessian = hessian_of_foot(found[n], target_tree_);
    if (slope < 1) {  // along the distance the force is the same
      const Mat3 across = Mat3::Identity() - away.normalized() * away.normalized().transpose();
      hessian = across * hessian * across;
    }
    out.energy += of_body_ * area * energy;
    out.gradient[point] += of_body_ * area * slope * away;
    out.hessian[point] += of_body_ * area * slope * hessian;
    out.bound[point] += of_body_ * area * slope;
  }
}

void SurfaceMatching::pull_to_target(const std::vector<Vec3>& places, Pull& out) const {
  const SurfaceTree tree(places, body_.triangles);
  const std::vector<Foot> found =
      feet(tree, target_samples_.size(), [&](std::size_t n) { return target_.points[target_samples_[n].point]; });
  for (std::size_t n = 0; n < found.size(); ++n) {
    const Foot& foot = found[n];
    const auto& [point, area] = target_samples_[n];
    const auto [energy, slope] = huber(foot.distance);
    const Vec3 away = foot.place - target_.points[point];
    const Vec3 normal = (foot.distance > 0 ? away : tree.normal(foot.triangle)).normalized();
    // Of a foot between three points each has its share: that is more than the Hessian, and not less.
    const double curvature = slope < 1 ? 0 : of_target_ * area;
    out.energy += of_target_ * area * energy;
    for (int corner = 0; corner < 3; ++corner) {
      const double weight = foot.weights[corner];
      if (weight <= 0) continue;
      const std::size_t p = hexmesh::as_size(body_.triangles[foot.triangle][static_cast<std::size_t>(corner)]);
      out.gradient[p] += of_target_ * area * slope * weight * away;
      out.hessian[p] += curvature * weight * normal * normal.transpose();
      out.bound[p] += of_target_ * area * slope * weight;
    }
  }
}

void SurfaceMatching::pair(const Eigen::Isometry3d& pose, std::size_t every, const Pair& f) const {
  const Eigen::Isometry3d back = pose.inverse();
  const auto count = [&](const std::vector<Sample>& samples) { return (samples.size() + every - 1) / every; };
  const auto on_body = feet(body_tree_, count(target_samples_), [&](std::size_t n) -> Vec3 {
    return back * target_.points[target_samples_[n * every].point];
  });
  for (std::size_t n = 0; n < on_body.size(); ++n) {
    const auto& [point, area] = target_samples_[n * every];
    f(area, huber(on_body[n].distance).second, on_body[n].place, target_.points[point]);
  }
  if (is_partial_) return;
  const auto on_target = feet(target_tree_, count(body_samples_), [&](std::size_t n) -> Vec3 {
    return pose * body_.points[body_samples_[n * every].point];
  });
  for (std::size_t n = 0; n < on_target.size(); ++n) {
    const auto& [point, area] = body_samples_[n * every];
    f(area, huber(on_target[n].distance).second, body_.points[point], on_target[n].place);
  }
}

Vec3 SurfaceMatching::middle() const {
  Vec3 sum = Vec3::Zero();
  double area = 0;
  for (std::size_t n = 0; n < target_.points.size(); ++n) {
    sum += target_areas_[n] * target_.points[n];
    area += target_areas_[n];
  }
  return area > 0 ? Vec3(sum / area) : sum;
}

Mat3 SurfaceMatching::spread() const {
  const Vec3 center = middle();
  Mat3 sum = Mat3::Zero();
  double area = 0;
  for (std::size_t n = 0; n < target_.points.size(); ++n) {
    const Vec3 x = target_.points[n] - center;
    sum += target_areas_[n] * x * x.transpose();
    area += target_areas_[n];
  }
  return area > 0 ? Mat3(sum / area) : sum;
}

MatchReport SurfaceMatching::distances(const std::vector<Vec3>& places) const {
  const auto measure = [](const SurfaceTree& tree, const std::vector<Vec3>& points, const std::vector<double>& areas) {
    const std::vector<Foot> found = feet(tree, points.size(), [&](std::size_t n) { return points[n]; });
    Distances out;
    for (std::size_t n = 0; n < found.size(); ++n)
      if (areas[n] > 0) out.emplace_back(found[n].distance, areas[n]);
    return out;
  };
  Distances both = measure(SurfaceTree(places, body_.triangles), target_.points, target_areas_);
  MatchReport out{name_, target_.points.size(), trust_};
  out.target_to_body = statistics(both);
  if (!is_partial_) {
    const Distances to_target = measure(target_tree_, places, hexmesh::areas_of_points(places, body_.triangles));
    out.body_to_target = statistics(to_target);
    both.insert(both.end(), to_target.begin(), to_target.end());
  }
  out.distance = statistics(std::move(both));
  return out;
}

}  // namespace hexsolver
