// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>

#include "hexmesh/core/index.h"

namespace hexmesh {

/// A point or vector in patient space, LPS axes [mm].
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

/// Regular voxel grid in patient space: where every scan, label volume and lattice lives.
///
/// Voxel (i, j, k) is centred at
///
///     x = origin + direction diag(spacing) (i, j, k)^T            (1)
///
/// where the columns of `direction` are the axis directions.
/// Source: DICOM PS3.3, C.7.6.2.1.1 (pixel to patient mapping), extended to slices.
///
/// Immutable: a Grid that exists is valid.
class Grid {
public:
  /// @param extent     voxels along i, j, k; each >= 1
  /// @param spacing    voxel size along i, j, k [mm]; each from 1e-9 to 1e9
  /// @param origin     centre of voxel (0, 0, 0) [mm]; within 1e12
  /// @param direction  orthonormal to 1e-3, either handedness
  /// @throws Error{input} if an argument breaks its bound; the message names it
  Grid(Index3 extent, Vec3 spacing, Vec3 origin = Vec3::Zero(), const Mat3& direction = Mat3::Identity());

  const Index3& extent() const noexcept { return extent_; }
  const Vec3& spacing() const noexcept { return spacing_; }
  const Vec3& origin() const noexcept { return origin_; }
  const Mat3& direction() const noexcept { return direction_; }

  std::size_t num_voxels() const noexcept { return count_in(extent_); }
  double voxel_volume() const noexcept { return spacing_.prod(); }  ///< [mm^3]

  bool contains(const Index3& ijk) const noexcept { return is_in(extent_, ijk); }

  /// Whether a continuous index lies in a voxel, the outermost faces included; false where it is not finite.
  bool covers(const Vec3& index) const noexcept;

  /// Index of a corner voxel, the last one along axis d where bit d of `n` is set.
  /// @param n  0 to 7
  Vec3 corner(int n) const noexcept;

  /// Position of a voxel in any per-voxel array: i + nx (j + ny k).
  /// @pre contains(ijk)
  std::size_t offset(const Index3& ijk) const noexcept { return offset_in(extent_, ijk); }

  /// Inverse of offset().
  Index3 index(std::size_t offset) const noexcept { return index_in(extent_, offset); }

  /// Patient position [mm] of a continuous index, eq. (1).
  Vec3 position(const Vec3& index) const { return origin_ + direction_ * spacing_.cwiseProduct(index); }

  /// Centre of a voxel [mm].
  Vec3 center(const Index3& ijk) const { return position(Vec3(ijk[0], ijk[1], ijk[2])); }

  /// Continuous index of a patient position [mm], inverse of eq. (1).
  Vec3 continuous_index(const Vec3& position) const {
    return (direction_.transpose() * (position - origin_)).cwiseQuotient(spacing_);
  }

private:
  Index3 extent_;
  Vec3 spacing_;
  Vec3 origin_;
  Mat3 direction_;
};

/// The voxel that a continuous index is in.
inline Index3 nearest_voxel(const Vec3& index) {
  return {static_cast<std::int32_t>(std::lround(index[0])), static_cast<std::int32_t>(std::lround(index[1])),
          static_cast<std::int32_t>(std::lround(index[2]))};
}

/// True where two grids have the same extent and the same voxel centres to within `tolerance` of a voxel.
bool same_grid(const Grid& a, const Grid& b, double tolerance = 1e-3);

}  // namespace hexmesh
