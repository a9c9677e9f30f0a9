// SPDX-License-Identifier: Apache-2.0
#include "terms/cell_jacobians.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>

namespace hexsolver {
namespace {

using Vec3 = Eigen::Vector3d;
constexpr int along = hexmesh::subcells_along;

constexpr double center(int subcell) { return (subcell + 0.5) / along; }

/// dx / ds along an axis, which varies along the other two alone: at [p + 4 q], p along the next axis, q along the
/// last.
std::array<Vec3, along * along> tangents(const Eigen::Matrix<double, 3, 8>& corners, int axis) {
  const int next = 1 << (axis + 1) % 3, last = 1 << (axis + 2) % 3;
  const auto edge = [&](int a) -> Vec3 { return corners.col(a + (1 << axis)) - corners.col(a); };
  const std::array<Vec3, 4> edges = {edge(0), edge(next), edge(last), edge(next + last)};
  std::array<Vec3, along * along> out;
  for (int q = 0; q < along; ++q)
    for (int p = 0; p < along; ++p) {
      const double s = center(p), t = center(q);
      out[static_cast<std::size_t>(p + along * q)] =
          (1 - t) * ((1 - s) * edges[0] + s * edges[1]) + t * ((1 - s) * edges[2] + s * edges[3]);
    }
  return out;
}

/// det dx / ds at the centres of the subcells.
class Determinants {
public:
  explicit Determinants(const Eigen::Matrix<double, 3, 8>& corners)
      : t_{tangents(corners, 0), tangents(corners, 1), tangents(corners, 2)} {}

  double at(int i, int j, int k) const { return of(0, j, k).dot(of(1, k, i).cross(of(2, i, j))); }

private:
  const Vec3& of(std::size_t axis, int p, int q) const { return t_[axis][static_cast<std::size_t>(p + along * q)]; }

  std::array<std::array<Vec3, along * along>, 3> t_;
};

}  // namespace

Jacobians jacobians_in_subcells(const Eigen::Matrix<double, 3, 8>& now, const Eigen::Matrix<double, 3, 8>& rest,
                                hexmesh::SubcellMask where) {
  const Determinants moved(now), at_rest(rest);
  double volume = 0, volume_at_rest = 0;
  Jacobians out{std::numeric_limits<double>::infinity(), 0, 0};
  int count = 0, inside_out = 0;
  for (int k = 0; k < along; ++k)
    for (int j = 0; j < along; ++j)
      for (int i = 0; i < along; ++i) {
        if ((where >> (i + along * (j + along * k)) & 1U) == 0) continue;
        const double jacobian = moved.at(i, j, k) / at_rest.at(i, j, k);
        out.least = std::min(out.least, jacobian);
        volume += moved.at(i, j, k);
        volume_at_rest += at_rest.at(i, j, k);
        inside_out += jacobian <= 0;
        ++count;
      }
  out.mean = volume / volume_at_rest;
  out.inside_out = static_cast<double>(inside_out) / count;
  return out;
}

}  // namespace hexsolver
