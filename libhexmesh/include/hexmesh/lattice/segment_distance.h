// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hexmesh/core/grid.h"
#include "hexmesh/geometry/solid.h"

namespace hexmesh {

/// How far places at rest are from the surface of a segment, smoothly: the distance from its voxels, outside, or from
/// those that are none of its, inside; averaged over neighbours so that the steps of voxels turn into slopes, and
/// interpolated by quadratic B-splines, so that its gradient is continuous. Averages are over next neighbours, or over
/// some ten voxels, or sixteen, where these give a surface that would be cut into the same voxels: wide terraces become
/// round. Not within eight voxels, or twenty, of where they do not, edges and what is thin, and not where there are no
/// steps.
///
/// Where another segment touches it the face between both goes on a little beyond its rim, into what is nearer to this
/// one than to the other: averages would round off the rim. Where the segment itself is more than two voxels farther
/// away the distance grows by the square of what that is more.
class SegmentDistance {
public:
  /// Farther than so many of the longest edges of a voxel all is as far.
  static constexpr int most_voxels = 18;

  /// @param voxels, labels  of a lattice's box; beyond it there is nothing
  /// @param beside  label of the other segment
  SegmentDistance(const Grid& voxels, std::span<const std::uint16_t> labels, std::uint16_t label, std::uint16_t beside);

  /// @returns depth < 0 inside [mm], its gradient (of a length near 1) and second derivatives
  Gap gap(const Vec3& place) const;

  /// Radius of the largest ball inside, as far as that is told [mm].
  double thickness() const noexcept { return thickness_; }
  std::size_t bytes() const { return (values_.size() + alone_.size()) * sizeof(float); }

private:
  std::size_t offset(const Index3& v) const { return offset_in(extent_, v); }
  std::vector<char> voxels_of(std::span<const std::uint16_t> labels, std::uint16_t label) const;
  bool extend(std::vector<char>& is_inside, const std::vector<char>& is_beside) const;  ///< whether another touches
  std::vector<float> measured(const std::vector<char>& is_inside) const;
  std::vector<float> smoothed(const std::vector<float>& values) const;
  struct Means {
    int reach;            ///< over 2 reach + 1 neighbours, three times
    double most;          ///< farther all is as far, so that balls stay as large as they are [voxels]
    double little, much;  ///< how far from features they are not taken, and taken as they are [voxels]
  };
  void smooth_widely(std::vector<float>& out, const std::vector<float>& values, const std::vector<float>& narrow,
                     const Means& means) const;
  std::vector<float> mean_over(const std::vector<float>& values, const Means& means) const;
  void smooth_narrowly(std::vector<float>& values) const;
  Gap interpolate(const std::vector<float>& values, const Vec3& place) const;

  Grid voxels_;
  Mat3 to_index_;              ///< from patient space
  Index3 first_{}, extent_{};  ///< of a box around the segment, in voxels of the lattice's box
  std::vector<float> values_;  ///< [mm]
  std::vector<float> alone_;   ///< without what goes on beyond a rim; empty where nothing does
  double thickness_ = 0;
  float most_ = 0;  ///< the farthest that is told [mm]
};

}  // namespace hexmesh
