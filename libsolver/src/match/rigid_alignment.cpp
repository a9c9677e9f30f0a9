// SPDX-License-Identifier: Apache-2.0
#include "match/rigid_alignment.h"

#include <algorithm>
#include <cmath>

#include "core/rigid_fit.h"
#include "core/symmetric_eigen.h"

namespace hexsolver {
namespace {

using Eigen::Isometry3d;

struct Aligned {
  Isometry3d pose;
  double distance;  ///< root of the mean square of what is left [mm]
};

/// @param center  near the body: fits are about it, for the rounding's sake
Aligned iterate(const Matchings& matchings, const Vec3& center, Isometry3d pose, std::size_t every, int most) {
  constexpr double still = 1e-5;  // of the size of the body, that a step moves it by
  double size = 0, left = 0;
  for (int n = 0; n < most; ++n) {
    RigidFit fit;
    double all = 0, sum = 0;
    for (const auto& m : matchings)
      m->pair(pose, every, [&](double area, double part, const Vec3& rest, const Vec3& wanted) {
        fit.add(area * part, rest - center, wanted - rest);
        size = std::max(size, (rest - center).norm());
        all += area;
        sum += area * part * (pose * rest - wanted).squaredNorm();
      });
    left = all > 0 ? std::sqrt(sum / all) : 0;
    if (all == 0 || left <= 1e-12 * size) break;
    fit.solve();
    const Isometry3d next = Eigen::Translation3d(center) * fit.motion() * Eigen::Translation3d(-center);
    const Isometry3d change = pose.inverse() * next;
    pose = next;
    if ((change.linear() - Mat3::Identity()).norm() * size + (change * center - center).norm() < still * size) break;
  }
  return {pose, left};
}

/// Axes of a spread, longest last, right-handed.
Mat3 axes_of(const Mat3& spread) {
  Mat3 axes = symmetric_eigen(spread).vectors;
  if (axes.determinant() < 0) axes.col(0) *= -1;
  return axes;
}

}  // namespace

Isometry3d align(const Matchings& matchings) {
  constexpr int of_first = 20, of_last = 100;
  constexpr std::size_t samples = 1000;
  constexpr double far_nearer = 0.5;
  std::size_t most_points = 1;
  const Matching* whole = nullptr;
  Vec3 center = Vec3::Zero();
  for (const auto& m : matchings) {
    most_points = std::max(most_points, m->points().size());
    if (m->is_whole() && !whole) whole = m.get();
  }
  Mat3 spread = Mat3::Zero();
  const std::vector<Vec3>& body = (whole ? whole : matchings.front().get())->points();
  for (const Vec3& p : body) center += p / static_cast<double>(body.size());
  for (const Vec3& p : body) spread += (p - center) * (p - center).transpose();
  const std::size_t every = std::max<std::size_t>(1, std::min(most_points, std::size_t{10'000}) / samples);

  Aligned best = iterate(matchings, center, Isometry3d::Identity(), every, of_first);
  if (whole) {
    const auto from = [&](const Mat3& turn) -> Isometry3d {
      return Eigen::Translation3d(whole->middle()) * Isometry3d(turn) * Eigen::Translation3d(-center);
    };
    const auto try_from = [&](const Mat3& turn, double part) {
      const Aligned other = iterate(matchings, center, from(turn), every, of_first);
      if (other.distance < part * best.distance) best = other;
    };
    try_from(Mat3::Identity(), 1);
    const Mat3 of_target = axes_of(whole->spread()), of_body = axes_of(spread);
    for (int n = 0; n < 4; ++n) {  // axes have no sense of their own
      Vec3 signs = Vec3::Constant(-1);
      if (n == 3)
        signs.setOnes();
      else
        signs[n] = 1;
      try_from(of_target * signs.asDiagonal() * of_body.transpose(), far_nearer);
    }
  }
  return iterate(matchings, center, best.pose, every, of_last).pose;
}

Scene placed(Scene scene, const Matchings& matchings) {
  if (!matchings.empty() && scene.conditions.empty() && !scene.pose) scene.pose = align(matchings);
  return scene;
}

}  // namespace hexsolver
