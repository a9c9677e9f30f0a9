// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>

#include "hexmesh/geometry/triangle_surface.h"

namespace hexmesh {

/// The point of a surface that is nearest to a place.
struct Foot {
  std::size_t triangle = 0;
  Vec3 weights = Vec3::Zero();  ///< of the corners of the triangle, each in [0, 1], sum 1
  Vec3 place = Vec3::Zero();    ///< [mm]
  double distance = 0;          ///< from the place [mm]
};

/// Corners of a triangle.
using Triangle = std::array<Vec3, 3>;

/// The point of a triangle, with its edges and corners, that is nearest to a place.
Foot nearest_in(const Triangle& triangle, const Vec3& place);

/// Finds the nearest point of a surface, in a tree of boxes (Eigen's KdBVH).
class SurfaceTree {
public:
  /// Both must outlive this, and stay as they are.
  SurfaceTree(std::span<const Vec3> points, std::span<const std::array<std::int32_t, 3>> triangles);
  ~SurfaceTree();

  /// @param guess  a triangle that may be near: the nearer it is the quicker the search, the foot is the same
  /// @pre there is a triangle
  Foot nearest(const Vec3& place, std::size_t guess = 0) const;

  Triangle corners(std::size_t triangle) const;
  /// Outward, as long as twice the area [mm^2].
  Vec3 normal(std::size_t triangle) const;

private:
  struct Boxes;
  std::span<const Vec3> points_;
  std::span<const std::array<std::int32_t, 3>> triangles_;
  std::unique_ptr<Boxes> boxes_;
};

/// Of each point of a surface: a third of the area of its triangles [mm^2].
std::vector<double> areas_of_points(std::span<const Vec3> points,
                                    std::span<const std::array<std::int32_t, 3>> triangles);

}  // namespace hexmesh
