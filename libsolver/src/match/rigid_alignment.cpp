// SPDX-License-Identifier: Apache-2.0
#include "match/rigid_alignment.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/rigid_fit.h"
#include "core/symmetric_eigen.h"

namespace hexsolver {
namespace {

using Eigen::Isometry3d;

struct Aligned {
  Isometry3d pose;
  double distance;  ///< root of the mean square of what is left, of what is far less [mm]
};

/// @param center  near the body: fits are about it, for the rounding's sake
Aligned iterate(const Matchings& matchings, const Vec3& center, Isometry3d pose, std::size_t every, int most,
                bool lets_go) {
  constexpr double still = 1e-5;  // of the size of the body, that a step moves it by
  double size = 0, left = 0;
  for (int n = 0; n < most; ++n) {
    RigidFit fit;
    double all = 0, sum = 0;
    for (const auto& m : matchings)
      m->pair(pose, every, lets_go, [&](const Matching::Pair& p) {
        fit.add(p.area * p.part, p.rest - center, p.wanted - p.rest);
        size = std::max(size, (p.rest - center).norm());
        all += p.area;
        sum += p.area * p.loss;
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

/// Turns that bring axes onto axes, and each of these turned by 60 degrees about two diagonals: 72.
std::vector<Mat3> turns_all_around() {
  std::vector<Mat3> out, between = {Mat3::Identity()};
  for (const Vec3& axis : {Vec3(1, 1, 1), Vec3(1, -1, 0)})
    between.push_back(Eigen::AngleAxisd(std::acos(-1.0) / 3, axis.normalized()).toRotationMatrix());
  std::array<int, 3> axis = {0, 1, 2};
  do
    for (int signs = 0; signs < 8; ++signs) {
      Mat3 turn = Mat3::Zero();
      for (int d = 0; d < 3; ++d) turn(axis[static_cast<std::size_t>(d)], d) = signs & 1 << d ? -1 : 1;
      if (turn.determinant() > 0)
        for (const Mat3& rest : between) out.push_back(turn * rest);
    }
  while (std::next_permutation(axis.begin(), axis.end()));
  return out;
}

/// Iterations from several starts: a few from each, and on from the nearest ones.
class Search {
public:
  Search(const Matchings& matchings, const Vec3& center, std::size_t every)
      : matchings_(matchings), center_(center), every_(every) {
    from(Isometry3d::Identity(), 1, true);
  }

  double least() const { return std::min_element(ends_.begin(), ends_.end(), nearer)->reached.distance; }
  /// @param part     of the distance from where the body is, that it must end below to be taken in place of that
  /// @param is_near  what is far there is none of the target; else of the start
  void from(const Isometry3d& start, double part, bool is_near = false) {
    ends_.push_back({iterate(matchings_, center_, start, coarser * every_, few, is_near), part, is_near});
  }
  /// From the middle of a target, turned about the body's.
  void from_middle(const Matching& of, const Mat3& turn, double part) {
    from(Eigen::Translation3d(of.middle()) * Isometry3d(turn) * Eigen::Translation3d(-center_), part);
  }
  Isometry3d best() {
    std::stable_sort(ends_.begin() + 1, ends_.end(), nearer);
    ends_.resize(std::min(ends_.size(), most_ends));
    const double hopeless = far_from_least * least();
    std::vector<End> kept = {ends_.front()};
    for (const End& e : ends_)
      if (e.reached.distance <= hopeless &&
          std::none_of(kept.begin(), kept.end(), [&](const End& k) { return is_same(k.reached, e.reached); }))
        kept.push_back(e);
    ends_ = std::move(kept);
    for (End& e : ends_)
      for (const bool lets_go : {false, true})
        if (lets_go || !e.is_near) e.reached = iterate(matchings_, center_, e.reached.pose, every_, many, lets_go);
    const double first = ends_.front().reached.distance;
    const End* best = &ends_.front();
    for (const End& e : ends_)
      if (e.reached.distance < e.part * first && nearer(e, *best)) best = &e;
    return best->reached.pose;
  }

private:
  struct End {
    Aligned reached;
    double part;
    bool is_near;
  };
  static bool nearer(const End& a, const End& b) { return a.reached.distance < b.reached.distance; }
  static constexpr std::size_t coarser = 3;  ///< samples of the first iterations
  static constexpr int few = 40, many = 100;
  /// Whether iterations are on their way to the same pose.
  static bool is_same(const Aligned& a, const Aligned& b) {
    constexpr double little = 0.1;  // of what is left
    return a.pose.isApprox(b.pose, 1e-2) && std::abs(a.distance - b.distance) <= little * a.distance;
  }
  static constexpr double far_from_least = 3;
  static constexpr std::size_t most_ends = 20;
  const Matchings& matchings_;
  Vec3 center_;
  std::size_t every_;
  std::vector<End> ends_;  ///< the first is from where the body is
};

}  // namespace

Isometry3d align(const Matchings& matchings) {
  constexpr std::size_t samples = 1000;
  constexpr double far_nearer = 0.5, near = 0.02;
  std::size_t most_points = 1;
  const Matching *whole = nullptr, *part = nullptr;
  Matchings landmarks;
  for (const auto& m : matchings) {
    most_points = std::max(most_points, m->points().size());
    if (m->is_whole() && !whole) whole = m.get();
    if (!m->is_whole() && !m->is_of_landmarks() && !part) part = m.get();
    if (m->is_of_landmarks()) landmarks.push_back(m);
  }
  const std::vector<Vec3>& body = (whole ? whole : part ? part : matchings.front().get())->points();
  Vec3 center = Vec3::Zero();
  for (const Vec3& p : body) center += p / static_cast<double>(body.size());
  Mat3 spread = Mat3::Zero();
  for (const Vec3& p : body) spread += (p - center) * (p - center).transpose() / static_cast<double>(body.size());
  const std::size_t every = std::max<std::size_t>(1, std::min(most_points, std::size_t{10'000}) / samples);

  Search search(matchings, center, every);
  if (!landmarks.empty() && landmarks.size() < matchings.size())
    search.from(iterate(landmarks, center, Isometry3d::Identity(), 1, 1, false).pose, far_nearer);
  if (whole) {
    search.from_middle(*whole, Mat3::Identity(), 1);
    const Mat3 of_target = axes_of(whole->spread()), of_body = axes_of(spread);
    for (int n = 0; n < 4; ++n) {  // axes have no sense of their own
      Vec3 signs = Vec3::Constant(-1);
      if (n == 3)
        signs.setOnes();
      else
        signs[n] = 1;
      search.from_middle(*whole, of_target * signs.asDiagonal() * of_body.transpose(), far_nearer);
    }
  } else if (part && search.least() > near * std::sqrt(spread.trace())) {
    for (const Mat3& turn : turns_all_around()) search.from_middle(*part, turn, far_nearer);
  }
  return search.best();
}

Scene placed(Scene scene, const Matchings& matchings) {
  if (!matchings.empty() && scene.conditions.empty() && !scene.pose) scene.pose = align(matchings);
  return scene;
}

}  // namespace hexsolver
