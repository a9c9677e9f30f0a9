// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "match/matching.h"

namespace hexsolver {

/// Points of a body to places: W = sum of s / 2 |x - place|^2. They do not slide.
class LandmarkMatching final : public Matching {
public:
  /// @param area       that each stands for [mm^2]
  /// @param stiffness  of that [N/mm^3]
  LandmarkMatching(const Match& match, double area, double stiffness)
      : name_(match.name),
        trust_(match.trust),
        points_(match.from),
        wanted_(match.to),
        area_(area),
        stiffness_(area * stiffness) {}

  const std::vector<Vec3>& points() const override { return points_; }
  void pull(const std::vector<Vec3>& places, const Eigen::Isometry3d& pose, Pull& out) const override;
  void pair(const Eigen::Isometry3d& pose, std::size_t every, const Pair& f) const override;
  bool is_whole() const override { return false; }
  bool judges_mean() const override { return false; }
  Vec3 middle() const override { return Vec3::Zero(); }
  Mat3 spread() const override { return Mat3::Zero(); }
  MatchReport distances(const std::vector<Vec3>& places) const override;

private:
  std::string name_;
  double trust_;
  std::vector<Vec3> points_, wanted_;
  double area_, stiffness_;
};

}  // namespace hexsolver
