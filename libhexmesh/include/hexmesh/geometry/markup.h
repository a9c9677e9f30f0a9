// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hexmesh/geometry/box.h"

namespace hexmesh {

/// What a user marked in 3D Slicer, in LPS [mm].
struct Markup {
  std::string type;          ///< "Fiducial", "Line", "ROI", ...
  std::vector<Vec3> points;  ///< control points
  std::optional<Box> box;    ///< of a ROI
};

}  // namespace hexmesh
