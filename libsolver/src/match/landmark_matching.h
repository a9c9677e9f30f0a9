// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "match/matching.h"

namespace hexsolver {

/// Points of a body to places: W = sum of s / 2 |x - place|^2. They do not slide.
class LandmarkMatching final : public Matching {
public:
  /// @param area       that each stands for [mm^2]
  /// @param stiffness  of that [N/mm^3]
  /// @param size       of the body [mm]
  LandmarkMatching(const Match& match, double area, double stiffness, double size)
      : name_(match.name),
        trust_(match.trust),
        size_(size),
        points_(match.from),
        wanted_(match.to),
        area_(area),
        stiffness_(area * stiffness) {}

  const std::vector<Vec3>& points() const override { return points_; }
  void pull(const std::vector<Vec3>& places, const Eigen::Isometry3d& pose, bool lets_go, Pull& out) const override;
  void pair(const Eigen::Isometry3d& pose, std::size_t every, bool lets_go,
            const std::function<void(const Pair&)>& f) const override;
  bool is_whole() const override { return false; }
  bool is_of_landmarks() const override { return true; }
  Vec3 middle() const override { return Vec3::Zero(); }
  Mat3 spread() const override { return Mat3::Zero(); }
  MatchReport distances(const std::vector<Vec3>& places) const override;
  std::optional<std::string> why_missed(const MatchReport& distances) const override;

private:
  std::string name_;
  double trust_, size_;
  std::vector<Vec3> points_, wanted_;
  double area_, stiffness_;
};

}  // namespace hexsolver
