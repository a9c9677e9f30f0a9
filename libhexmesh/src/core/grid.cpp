// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/core/grid.h"

#include <fmt/format.h>

#include <Eigen/LU>

#include "hexmesh/core/error.h"

namespace hexmesh {
namespace {

/// Far beyond any scan, and where squares and volumes of lengths still are numbers.
constexpr double least_spacing = 1e-9, most_spacing = 1e9, most_distance = 1e12;  // [mm]

}  // namespace

Grid::Grid(Index3 extent, Vec3 spacing, Vec3 origin, const Mat3& direction)
    : extent_(extent), spacing_(std::move(spacing)), origin_(std::move(origin)), direction_(direction) {
  for (int d = 0; d < 3; ++d) {
    if (extent_[d] < 1)
      throw Error(ErrorKind::input, fmt::format("grid extent along axis {} is {}, expected at least 1", d, extent_[d]));
    if (!(spacing_[d] >= least_spacing && spacing_[d] <= most_spacing))  // NaN is not
      throw Error(ErrorKind::input, fmt::format("grid spacing along axis {} is {}, expected {:g} to {:g} mm", d,
                                                spacing_[d], least_spacing, most_spacing));
  }
  if (!(origin_.cwiseAbs().maxCoeff() <= most_distance))
    throw Error(ErrorKind::input, fmt::format("grid origin is ({:g}, {:g}, {:g}), expected within {:g} mm", origin_[0],
                                              origin_[1], origin_[2], most_distance));
  const Mat3 gram = direction_.transpose() * direction_;
  if (!direction_.allFinite() || !gram.isIdentity(1e-3))
    throw Error(ErrorKind::input,
                "grid directions are not orthonormal (sheared, singular or not finite), expected three unit axes "
                "at right angles");
}

bool Grid::covers(const Vec3& index) const noexcept {
  for (int d = 0; d < 3; ++d)
    if (!(index[d] >= -0.5 && index[d] <= extent_[d] - 0.5)) return false;
  return true;
}

Vec3 Grid::corner(int n) const noexcept {
  Vec3 index;
  for (int d = 0; d < 3; ++d) index[d] = (n >> d & 1) ? extent_[d] - 1 : 0;
  return index;
}

bool same_grid(const Grid& a, const Grid& b, double tolerance) {
  if (a.extent() != b.extent()) return false;
  const double allowed = tolerance * a.spacing().minCoeff();
  for (int n = 0; n < 8; ++n)
    if ((a.position(a.corner(n)) - b.position(b.corner(n))).norm() > allowed) return false;
  return true;
}

}  // namespace hexmesh
