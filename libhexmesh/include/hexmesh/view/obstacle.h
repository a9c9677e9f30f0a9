// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "hexmesh/geometry/solid.h"
#include "hexmesh/warp/bounds.h"

namespace hexmesh {

/// An obstacle of a scene.
struct Obstacle {
  Solid solid;
  std::string name = {};

  /// How far a place is from being inside; < 0: it is [mm].
  double depth(const Vec3& x) const { return gap_to(solid, x).depth; }
};

/// Obstacles as triangles (.vtp, VTK XML), planes as a square beside the body: cell data `obstacle` (number) and
/// `name`.
/// @param body  its bounds
/// @param path  ends in .vtp
/// @throws Error{output}
void write_obstacles_vtp(const std::vector<Obstacle>& obstacles, const Bounds& body, const std::filesystem::path& path);

}  // namespace hexmesh
