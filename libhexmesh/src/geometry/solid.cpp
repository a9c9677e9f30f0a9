// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/geometry/solid.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace hexmesh {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

/// Of the distance from a point, or across a line from it; `along` is 0 or the direction of the line.
Gap round_gap(const Vec3& from_middle, double radius, const Vec3& along) {
  const double distance = from_middle.norm();
  if (distance == 0) {
    const Vec3 any = along.isZero(0) ? Vec3::UnitX() : Vec3(along.unitOrthogonal());
    return {-radius, any, Mat3::Zero()};
  }
  const Vec3 normal = from_middle / distance;
  const Mat3 across = Mat3::Identity() - normal * normal.transpose() - along * along.transpose();
  return {distance - radius, normal, across / distance};
}

/// Of a solid that is what several have in common: the one that a place is farthest out of. Beside an edge the nearest
/// point is of both.
Gap farthest_out(const Gap& a, const Gap& b) {
  if (a.depth <= 0 || b.depth <= 0) return a.depth >= b.depth ? a : b;
  const Vec3 out = a.depth * a.normal + b.depth * b.normal;
  return {out.norm(), out.normalized(), Mat3::Zero()};
}

struct GapTo {
  const Vec3& x;

  Gap operator()(const HalfSpace& s) const { return {(x - s.point).dot(s.normal), s.normal, Mat3::Zero()}; }
  Gap operator()(const Ball& s) const { return round_gap(x - s.center, s.radius, Vec3::Zero()); }
  Gap operator()(const Capsule& s) const {
    const Vec3 line = s.to - s.from;
    const double at = std::clamp((x - s.from).dot(line) / line.squaredNorm(), 0.0, 1.0);
    const bool is_end = at == 0 || at == 1;
    return round_gap(x - s.from - at * line, s.radius, is_end ? Vec3::Zero() : Vec3(line.normalized()));
  }
  Gap operator()(const Cylinder& s) const {
    const Vec3 axis = (s.to - s.from).normalized();
    const double along = (x - s.from).dot(axis), length = (s.to - s.from).norm();
    const Gap side = round_gap(x - s.from - along * axis, s.radius, axis);
    const bool is_upper = along > length / 2;
    return farthest_out(side, {is_upper ? along - length : -along, is_upper ? axis : Vec3(-axis), Mat3::Zero()});
  }
  Gap operator()(const Block& s) const {
    const Vec3 local = s.axes.transpose() * (x - s.center);
    const auto of_axis = [&](int d) -> Gap {
      const double side = local[d] < 0 ? -1 : 1;
      return {std::abs(local[d]) - s.half[d], side * s.axes.col(d), Mat3::Zero()};
    };
    return farthest_out(farthest_out(of_axis(0), of_axis(1)), of_axis(2));
  }
  Gap operator()(const std::shared_ptr<const Enclosed>& s) const { return s->gap(x); }
};

struct Thickness {
  double operator()(const HalfSpace& /*s*/) const { return infinite; }
  double operator()(const Ball& s) const { return s.radius; }
  double operator()(const Capsule& s) const { return s.radius; }
  double operator()(const Cylinder& s) const { return std::min(s.radius, (s.to - s.from).norm() / 2); }
  double operator()(const Block& s) const { return s.half.minCoeff(); }
  double operator()(const std::shared_ptr<const Enclosed>& s) const { return s->thickness(); }
};

struct Reach {
  const Vec3& x;

  double operator()(const HalfSpace& /*s*/) const { return infinite; }
  double operator()(const Ball& s) const { return (s.center - x).norm() + s.radius; }
  double operator()(const Capsule& s) const { return std::max((s.from - x).norm(), (s.to - x).norm()) + s.radius; }
  double operator()(const Cylinder& s) const { return std::max((s.from - x).norm(), (s.to - x).norm()) + s.radius; }
  double operator()(const Block& s) const { return (s.center - x).norm() + s.half.norm(); }
  double operator()(const std::shared_ptr<const Enclosed>& s) const {
    double out = 0;
    for (const Vec3& p : s->surface().points) out = std::max(out, (p - x).norm());
    return out;
  }
};

struct Placed {
  const Eigen::Isometry3d& to;

  Solid operator()(const HalfSpace& s) const { return HalfSpace{to * s.point, to.linear() * s.normal}; }
  Solid operator()(const Ball& s) const { return Ball{to * s.center, s.radius}; }
  Solid operator()(const Capsule& s) const { return Capsule{to * s.from, to * s.to, s.radius}; }
  Solid operator()(const Cylinder& s) const { return Cylinder{to * s.from, to * s.to, s.radius}; }
  Solid operator()(const Block& s) const { return Block{to * s.center, to.linear() * s.axes, s.half}; }
  Solid operator()(const std::shared_ptr<const Enclosed>& s) const {
    TriangleSurface moved = s->surface();
    for (Vec3& p : moved.points) p = to * p;
    return std::make_shared<const Enclosed>(std::move(moved));
  }
};

}  // namespace

Gap gap_to(const Solid& solid, const Vec3& place) { return std::visit(GapTo{place}, solid); }
Solid placed(const Solid& solid, const Eigen::Isometry3d& place) { return std::visit(Placed{place}, solid); }
double thickness_of(const Solid& solid) { return std::visit(Thickness{}, solid); }
double reach_of(const Solid& solid, const Vec3& place) { return std::visit(Reach{place}, solid); }

}  // namespace hexmesh
