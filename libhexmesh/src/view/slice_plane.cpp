// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "hexmesh/view/slice.h"

namespace hexmesh {

std::string orientation_letters(const Vec3& direction) {
  constexpr std::array<std::array<char, 2>, 3> names = {{{'R', 'L'}, {'A', 'P'}, {'I', 'S'}}};  // towards -, +
  std::array<std::size_t, 3> order = {0, 1, 2};
  const Vec3 d = direction.normalized();
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return std::abs(d[a]) > std::abs(d[b]); });
  std::string out;
  for (const std::size_t axis : order) {
    const double part = d[axis];
    if (out.empty() || std::abs(part) > 0.26) out += names[axis][part > 0 ? 1 : 0];  // sin 15 degrees
  }
  return out;
}

SlicePlane plane_across(SliceAxis axis, double position) {
  const auto across = static_cast<Eigen::Index>(axis);
  SlicePlane plane;
  plane.name = axis == SliceAxis::axial ? "axial" : axis == SliceAxis::coronal ? "coronal" : "sagittal";
  plane.point = position * Vec3::Unit(across);
  plane.right = axis == SliceAxis::sagittal ? Vec3::UnitY() : Vec3::UnitX();
  plane.down = axis == SliceAxis::axial ? Vec3(Vec3::UnitY()) : Vec3(-Vec3::UnitZ());
  return plane;
}

SlicePlane oblique_plane(const Vec3& point, const Vec3& normal) {
  Eigen::Index nearest = 0;
  normal.cwiseAbs().maxCoeff(&nearest);
  const SlicePlane like = plane_across(static_cast<SliceAxis>(nearest), 0);
  Vec3 view = normal.normalized();
  if (view.dot(like.right.cross(like.down)) < 0) view = -view;
  SlicePlane plane{"oblique", point, {}, {}};
  plane.down = (like.down - like.down.dot(view) * view).normalized();
  plane.right = plane.down.cross(view);
  return plane;
}

}  // namespace hexmesh
