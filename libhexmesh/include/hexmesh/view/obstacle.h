// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "hexmesh/warp/bounds.h"

namespace hexmesh {

/// An obstacle of a scene: a plane, or a ball where it has a radius.
struct Obstacle {
  Vec3 point = Vec3::Zero();   ///< of the plane; centre of the ball [mm]
  Vec3 normal = Vec3::Zero();  ///< of the plane, towards the body; a unit vector
  double radius = 0;           ///< [mm]
  std::string name = {};

  /// How far a place is from being inside; < 0: it is [mm].
  double depth(const Vec3& x) const { return radius > 0 ? (x - point).norm() - radius : (x - point).dot(normal); }
};

/// Obstacles as triangles (.vtp, VTK XML), planes as a square beside the body: cell data `obstacle` (number) and
/// `name`.
/// @param body  its bounds
/// @param path  ends in .vtp
/// @throws Error{output}
void write_obstacles_vtp(const std::vector<Obstacle>& obstacles, const Bounds& body, const std::filesystem::path& path);

}  // namespace hexmesh
