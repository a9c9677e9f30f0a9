// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/geometry/surface_tree.h"
#include "match/distances.h"
#include "match/influence.h"
#include "match/matching.h"

namespace hexsolver {

/// The surface of a body onto another one, at rest in space:
///   W = sum over points b of the body      s_b rho(distance of b from the target)
///     + sum over points t of the target    s_t rho(distance of t from the deformed body),
/// rho(d) that of an Influence, which by default finds from all distances which ones are far. s is the stiffness of the
/// [[match]] times the area that a point stands for. Both sums have half of it; of a target that is a part of the
/// surface the second has all, and in place of the first the points of the body are held where it began, as little as
/// keeps it from drifting. Points slide: across the normal nothing holds them.
class SurfaceMatching final : public Matching {
public:
  /// @param body       at rest; its points are points()
  /// @param stiffness  [N/mm^3]
  /// @param size       of the body [mm]
  /// @throws Error{input} for a target of another size altogether
  SurfaceMatching(const Match& match, hexmesh::TriangleSurface body, double stiffness, double size);
  SurfaceMatching(const SurfaceMatching&) = delete;
  SurfaceMatching& operator=(const SurfaceMatching&) = delete;

  const std::vector<Vec3>& points() const override { return body_.points; }
  void pull(const std::vector<Vec3>& places, const Eigen::Isometry3d& pose, bool lets_go, Pull& out) const override;
  void pair(const Eigen::Isometry3d& pose, std::size_t every, bool lets_go,
            const std::function<void(const Pair&)>& f) const override;
  bool is_whole() const override { return !is_partial_; }
  bool is_of_landmarks() const override { return false; }
  Vec3 middle() const override;
  Mat3 spread() const override;
  MatchReport distances(const std::vector<Vec3>& places) const override;
  std::optional<std::string> why_missed(const MatchReport& distances) const override;

private:
  struct Sample {
    std::size_t point;
    double area;  ///< [mm^2]
  };
  static std::vector<Sample> samples_of(const std::vector<double>& areas);
  void hold(const std::vector<Vec3>& places, const Eigen::Isometry3d& pose, Pull& out) const;
  void pull_body(const std::vector<Vec3>& places, bool lets_go, Pull& out) const;
  void pull_to_target(const std::vector<Vec3>& places, bool lets_go, Pull& out) const;
  static Distances distances_of(const std::vector<hexmesh::Foot>& feet, const std::vector<Sample>& samples,
                                std::size_t every = 1);
  /// @param all    distances one way
  /// @param least  that is far [mm]
  Influence influence(const Distances& all, bool lets_go, double least) const;

  std::string name_;
  double trust_, size_;
  double followed_;  ///< a distance from where the body follows [mm]
  hexmesh::TriangleSurface body_, target_;
  bool is_partial_;                                ///< the target is a part of the surface
  std::optional<double> outliers_;                 ///< see Match
  double of_body_, of_target_;                     ///< stiffness [N/mm^3]
  std::vector<double> body_areas_, target_areas_;  ///< of points [mm^2]
  std::vector<std::int32_t> target_pieces_;        ///< of points
  std::vector<Sample> body_samples_, target_samples_;
  hexmesh::SurfaceTree body_tree_, target_tree_;  ///< at rest
};

}  // namespace hexsolver
