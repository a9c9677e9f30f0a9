// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/result/result.h"

namespace hexmesh {

/// Box of the body's voxels at rest and deformed together [mm], LPS.
struct Bounds {
  Vec3 low, high;
};
Bounds bounds_of(const Result& result);

}  // namespace hexmesh
