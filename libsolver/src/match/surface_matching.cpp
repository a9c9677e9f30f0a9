// SPDX-License-Identifier: Apache-2.0
#include "match/surface_matching.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "hexmesh/core/error.h"

namespace hexsolver {
namespace {

using hexmesh::Foot;
using hexmesh::SurfaceTree;

/// So many samples of a surface find its shape; more take time.
constexpr std::size_t most_samples = 10'000;
/// Of the distance trusted, from where a body follows: three times its Young's modulus as traction.
constexpr double of_trust = 30;
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

/// By area [mm].
Vec3 middle_of(const std::vector<Vec3>& points, const std::vector<double>& areas) {
  Vec3 sum = Vec3::Zero();
  double area = 0;
  for (std::size_t n = 0; n < points.size(); ++n) {
    sum += areas[n] * points[n];
    area += areas[n];
  }
  return area > 0 ? Vec3(sum / area) : sum;
}

/// About the middle: the mean of x x^T [mm^2].
Mat3 spread_of(const std::vector<Vec3>& points, const std::vector<double>& areas) {
  const Vec3 center = middle_of(points, areas);
  Mat3 sum = Mat3::Zero();
  double area = 0;
  for (std::size_t n = 0; n < points.size(); ++n) {
    const Vec3 x = points[n] - center;
    sum += areas[n] * x * x.transpose();
    area += areas[n];
  }
  return area > 0 ? Mat3(sum / area) : sum;
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

SurfaceMatching::SurfaceMatching(const Match& match, hexmesh::TriangleSurface body, double stiffness, double size)
    : name_(match.name),
      trust_(match.trust),
      size_(size),
      followed_(of_trust * match.trust),
      body_(std::move(body)),
      target_(match.target),
      is_partial_(match.is_partial ? *match.is_partial : hexmesh::edges_of(target_).open > 0),
      outliers_(match.outliers),
      of_body_(stiffness * (is_partial_ ? of_unseen : 0.5)),
      of_target_(stiffness * (is_partial_ ? 1 : 0.5)),
      body_areas_(hexmesh::areas_of_points(body_.points, body_.triangles)),
      target_areas_(hexmesh::areas_of_points(target_.points, target_.triangles)),
      target_pieces_(hexmesh::pieces_of(target_)),
      body_samples_(samples_of(body_areas_)),
      target_samples_(samples_of(target_areas_)),
      body_tree_(body_.points, body_.triangles),
      target_tree_(target_.points, target_.triangles) {
  constexpr double most = 4, least = 0.25, least_part = 0.01;
  const double of_target = std::sqrt(spread().trace());
  const double of_body = std::sqrt(spread_of(body_.points, body_areas_).trace());
  if (of_target <= most * of_body && of_target >= (is_partial_ ? least_part : least) * of_body) return;
  throw hexmesh::Error(
      hexmesh::ErrorKind::input,
      fmt::format("{} has a radius of {:.3g} mm and the body one of {:.3g} mm, expected like sizes: is it in mm?",
                  with_place("match", match), of_target, of_body));
}

Influence SurfaceMatching::influence(const Distances& all, bool lets_go, double least) const {
  constexpr double of_median = 3;  // of normally distributed ones two standard deviations
  if (outliers_) return {*outliers_ > 0 ? *outliers_ : std::numeric_limits<double>::infinity(), lets_go};
  return {std::max({far_off * size_, least, of_median * median(all)}), lets_go};
}

Distances SurfaceMatching::distances_of(const std::vector<Foot>& feet, const std::vector<Sample>& samples,
                                        std::size_t every) {
  Distances all;
  for (std::size_t n = 0; n < feet.size(); ++n) all.emplace_back(feet[n].distance, samples[n * every].area);
  return all;
}

void SurfaceMatching::pull(const std::vector<Vec3>& places, const Eigen::Isometry3d& pose, bool lets_go,
                           Pull& out) const {
  out.reset(places.size());
  if (is_partial_)
    hold(places, pose, out);
  else
    pull_body(places, lets_go, out);
  pull_to_target(places, lets_go, out);
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

void SurfaceMatching::pull_body(const std::vector<Vec3>& places, bool lets_go, Pull& out) const {
  const std::vector<Foot> found =
      feet(target_tree_, body_samples_.size(), [&](std::size_t n) { return places[body_samples_[n].point]; });
  const Influence of = influence(distances_of(found, body_samples_), lets_go, followed_);
  for (std::size_t n = 0; n < found.size(); ++n) {
    const auto& [point, area] = body_samples_[n];
    const double part = of.part(found[n].distance);
    const Vec3 away = places[point] - found[n].place;
    Mat3 hessian = hessian_of_foot(found[n], target_tree_);
    if (part < 1) {  // along the distance the force does not grow
      const Mat3 across = Mat3::Identity() - away.normalized() * away.normalized().transpose();
      hessian = across * hessian * across;
    }
    out.energy += of_body_ * area * of.energy(found[n].distance);
    out.gradient[point] += of_body_ * area * part * away;
    out.hessian[point] += of_body_ * area * part * hessian;
    out.bound[point] += of_body_ * area * part;
  }
}

void SurfaceMatching::pull_to_target(const std::vector<Vec3>& places, bool lets_go, Pull& out) const {
  const SurfaceTree tree(places, body_.triangles);
  const std::vector<Foot> found =
      feet(tree, target_samples_.size(), [&](std::size_t n) { return target_.points[target_samples_[n].point]; });
  const Influence of = influence(distances_of(found, target_samples_), lets_go, followed_);
  for (std::size_t n = 0; n < found.size(); ++n) {
    const Foot& foot = found[n];
    const auto& [point, area] = target_samples_[n];
    const double part = of.part(foot.distance);
    const Vec3 away = foot.place - target_.points[point];
    const Vec3 normal = (foot.distance > 0 ? away : tree.normal(foot.triangle)).normalized();
    // Of a foot between three points each has its share: that is more than the Hessian, and not less.
    const double curvature = part < 1 ? 0 : of_target_ * area;
    out.energy += of_target_ * area * of.energy(foot.distance);
    for (int corner = 0; corner < 3; ++corner) {
      const double weight = foot.weights[corner];
      if (weight <= 0) continue;
      const std::size_t p = hexmesh::as_size(body_.triangles[foot.triangle][static_cast<std::size_t>(corner)]);
      out.gradient[p] += of_target_ * area * part * weight * away;
      out.hessian[p] += curvature * weight * normal * normal.transpose();
      out.bound[p] += of_target_ * area * part * weight;
    }
  }
}

void SurfaceMatching::pair(const Eigen::Isometry3d& pose, std::size_t every, bool lets_go,
                           const std::function<void(const Pair&)>& f) const {
  const Eigen::Isometry3d back = pose.inverse();
  /// @param to    point -> where its foot is looked for
  /// @param pair  (point, its foot) -> (at rest, wanted)
  const auto each = [&](const SurfaceTree& tree, const std::vector<Sample>& samples, const auto& to, const auto& pair) {
    const std::vector<Foot> found =
        feet(tree, (samples.size() + every - 1) / every, [&](std::size_t n) { return to(samples[n * every].point); });
    const Influence of = influence(distances_of(found, samples, every), lets_go, 0);
    for (std::size_t n = 0; n < found.size(); ++n) {
      const auto& [point, area] = samples[n * every];
      const auto& [rest, wanted] = pair(point, found[n].place);
      f({area, of.part(found[n].distance), 2 * Influence(of.far(), false).energy(found[n].distance), rest, wanted});
    }
  };
  using Ends = std::pair<const Vec3&, const Vec3&>;
  each(
      body_tree_, target_samples_, [&](std::size_t p) -> Vec3 { return back * target_.points[p]; },
      [&](std::size_t p, const Vec3& foot) { return Ends(foot, target_.points[p]); });
  if (is_partial_) return;
  each(
      target_tree_, body_samples_, [&](std::size_t p) -> Vec3 { return pose * body_.points[p]; },
      [&](std::size_t p, const Vec3& foot) { return Ends(body_.points[p], foot); });
}

Vec3 SurfaceMatching::middle() const { return middle_of(target_.points, target_areas_); }

Mat3 SurfaceMatching::spread() const { return spread_of(target_.points, target_areas_); }

MatchReport SurfaceMatching::distances(const std::vector<Vec3>& places) const {
  const auto measure = [](const SurfaceTree& tree, const std::vector<Vec3>& points, const std::vector<double>& areas) {
    const std::vector<Foot> found = feet(tree, points.size(), [&](std::size_t n) { return points[n]; });
    Distances out;
    for (std::size_t n = 0; n < found.size(); ++n) out.emplace_back(found[n].distance, areas[n]);
    return out;
  };
  Distances both, kept;
  double all = 0, left_out = 0;
  /// @param pieces  of the points
  /// @returns the part that is let go, without pieces that are nearly all, by area or by points, whichever is less: a
  ///          point that is drawn far out makes its triangles large
  const auto add = [&](const Distances& way, const std::vector<std::int32_t>& pieces) {
    constexpr double nearly_all = 0.9;
    struct Piece {
      double area = 0, far_area = 0, far_points = 0;
    };
    const Influence of = influence(way, true, followed_);
    std::map<std::int32_t, Piece> of_piece;
    Piece whole, within;
    for (std::size_t n = 0; n < way.size(); ++n) {
      const auto& [distance, area] = way[n];
      const bool is_far = of.ends_before(distance);
      Piece& piece = of_piece[pieces[n]];
      piece.area += area;
      piece.far_area += is_far ? area : 0;
      piece.far_points += is_far;
      if (!is_far && area > 0) kept.emplace_back(distance, area);
    }
    for (const auto& [number, piece] : of_piece) {
      whole.area += piece.area;
      left_out += piece.far_area;
      if (piece.far_area >= nearly_all * piece.area) continue;
      within.far_area += piece.far_area;
      within.far_points += piece.far_points;
    }
    all += whole.area;
    both.insert(both.end(), way.begin(), way.end());
    return whole.area > 0 ? std::min(within.far_area / whole.area, within.far_points / static_cast<double>(way.size()))
                          : 0;
  };
  MatchReport out{name_, target_.points.size(), trust_};
  out.is_part = is_partial_;
  const Distances to_body = measure(SurfaceTree(places, body_.triangles), target_.points, target_areas_);
  out.target_to_body = statistics(to_body);
  out.unreached = add(to_body, target_pieces_);
  if (!is_partial_) {
    const Distances to_target = measure(target_tree_, places, hexmesh::areas_of_points(places, body_.triangles));
    out.body_to_target = statistics(to_target);
    out.uncovered = add(to_target, std::vector<std::int32_t>(places.size()));
  }
  out.distance = statistics(std::move(both));
  out.kept_mean_mm = statistics(std::move(kept)).mean_mm;
  out.left_out = all > 0 ? left_out / all : 0;
  return out;
}

std::optional<std::string> SurfaceMatching::why_missed(const MatchReport& distances) const {
  constexpr double most_left_out = 0.2, most_within = 0.04;
  const double most = far_off * size_;
  if (distances.kept_mean_mm > most)
    return fmt::format(
        "match '{}' is {:.3g} mm off in the mean, expected at most {:.3g} mm, a hundredth of the body's size: is the "
        "target this body? A smaller trust_mm (--trust) pulls harder",
        name_, distances.kept_mean_mm, most);
  if (outliers_) return {};
  if (distances.uncovered > most_within)
    return fmt::format(
        "match '{}': {:.0f} % of the body's surface is far from the target, expected at most {:.0f} %: does that "
        "show a part of the body (part = true, --part)? outliers_mm (--outliers) says what is far",
        name_, 100 * distances.uncovered, 100 * most_within);
  if (distances.unreached > most_within || distances.left_out > most_left_out)
    return fmt::format(
        "match '{}': {:.0f} % of the target is far from the body, expected at most {:.0f} %, or {:.0f} % in pieces of "
        "their own: is all of it this body's? A larger trust_mm (--trust) may lead there; outliers_mm (--outliers) "
        "says what is "
        "far, 0: nothing",
        name_, 100 * std::max(distances.unreached, distances.left_out), 100 * most_within, 100 * most_left_out);
  return {};
}

}  // namespace hexsolver
