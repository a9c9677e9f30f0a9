// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <string>
#include <variant>

#include "hexmesh/geometry/triangle_surface.h"

namespace hexmesh {

/// All points within `radius` of `center`; as a place on a surface radius 0 is the one nearest point.
struct Ball {
  Vec3 center;    ///< [mm]
  double radius;  ///< [mm]
};

/// Points p with (p - point) . normal >= 0. As a solid it is the other half.
struct HalfSpace {
  Vec3 point, normal;
};

/// All points within `radius` of the line between two points.
struct Capsule {
  Vec3 from, to;  ///< [mm]
  double radius;  ///< [mm]
};

/// A round bar with flat ends.
struct Cylinder {
  Vec3 from, to;  ///< the middles of its ends [mm]
  double radius;  ///< [mm]
};

/// A box of any orientation.
struct Block {
  Vec3 center;  ///< [mm]
  Mat3 axes;    ///< columns = directions of its edges, of length 1
  Vec3 half;    ///< of its edges [mm]
};

/// What a closed surface of triangles encloses.
class Enclosed;

using Solid = std::variant<HalfSpace, Ball, Capsule, Cylinder, Block, std::shared_ptr<const Enclosed>>;

/// How far a place is from the surface of a solid.
struct Gap {
  double depth = 0;  ///< < 0: inside [mm]
  Vec3 normal;       ///< d depth / dx, out of the solid
  Mat3 bending;      ///< d2 depth / dx2; of triangles 0 [1/mm]
};

/// The signed distance. Outside of edges, and of the triangles of a closed surface, bending is left out.
Gap gap_to(const Solid& solid, const Vec3& place);

/// The same elsewhere.
Solid placed(const Solid& solid, const Eigen::Isometry3d& place);

/// Why a surface encloses no solid: it is open, one of its pieces that no other encloses is inside out, or it has no
/// volume to speak of. Empty where it does.
std::string fault_of_solid(const TriangleSurface& surface);

/// Radius of a ball that fits into it, about the largest; infinite for a half-space [mm].
double thickness_of(const Solid& solid);

/// The farthest that a point of it is from `place`; infinite for a half-space [mm].
double reach_of(const Solid& solid, const Vec3& place);

class Enclosed {
public:
  /// @pre the surface is closed, triangles counter-clockwise seen from outside
  explicit Enclosed(TriangleSurface surface);
  ~Enclosed();

  Gap gap(const Vec3& place) const;
  const TriangleSurface& surface() const noexcept { return surface_; }
  double thickness() const noexcept { return thickness_; }

private:
  struct Normals;
  TriangleSurface surface_;
  std::unique_ptr<Normals> normals_;
  double thickness_ = 0;
};

}  // namespace hexmesh
