// SPDX-License-Identifier: Apache-2.0
#include "match/landmark_matching.h"

#include <fmt/format.h>

#include <algorithm>

#include "match/distances.h"

namespace hexsolver {

void LandmarkMatching::pull(const std::vector<Vec3>& places, const Eigen::Isometry3d& /*pose*/, bool /*lets_go*/,
                            Pull& out) const {
  out.reset(places.size());
  for (std::size_t n = 0; n < places.size(); ++n) {
    const Vec3 away = places[n] - wanted_[n];
    out.energy += stiffness_ / 2 * away.squaredNorm();
    out.gradient[n] = stiffness_ * away;
    out.hessian[n] = stiffness_ * Mat3::Identity();
    out.bound[n] = stiffness_;
  }
}

/// All of them, however few samples of a surface are wanted: those of a surface stand for as much more.
void LandmarkMatching::pair(const Eigen::Isometry3d& pose, std::size_t every, bool /*lets_go*/,
                            const std::function<void(const Pair&)>& f) const {
  for (std::size_t n = 0; n < points_.size(); ++n)
    f({area_ / static_cast<double>(every), 1, (pose * points_[n] - wanted_[n]).squaredNorm(), points_[n], wanted_[n]});
}

MatchReport LandmarkMatching::distances(const std::vector<Vec3>& places) const {
  Distances all;
  for (std::size_t n = 0; n < places.size(); ++n) all.emplace_back((places[n] - wanted_[n]).norm(), 1);
  MatchReport out{name_, places.size(), trust_};
  out.worst = 1 + static_cast<std::size_t>(std::max_element(all.begin(), all.end()) - all.begin());
  out.distance = out.target_to_body = statistics(std::move(all));
  return out;
}

std::optional<std::string> LandmarkMatching::why_missed(const MatchReport& distances) const {
  const double most = std::max(far_off * size_, trust_), mean = distances.distance.mean_mm;
  if (mean <= most) return {};
  return fmt::format(
      "match '{}': landmarks are {:.3g} mm off in the mean, number {} by {:.3g} mm, expected at most {:.3g} mm: are "
      "they in the same order, and none mirrored? A larger trust_mm (--trust) takes them less exactly",
      name_, mean, distances.worst, distances.distance.largest_mm, most);
}

}  // namespace hexsolver
