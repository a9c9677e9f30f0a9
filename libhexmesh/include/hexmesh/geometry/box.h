// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/core/grid.h"

namespace hexmesh {

/// Points in a box; `to_box` maps patient space to [-1, 1]^3.
struct Box {
  Mat3 to_box;
  Vec3 center;
  bool contains(const Vec3& p) const { return (to_box * (p - center)).cwiseAbs().maxCoeff() <= 1 + 1e-9; }
};

/// A box along the patient axes.
/// @pre low < high
Box box_between(const Vec3& low, const Vec3& high);

/// The same box, larger by `margin` [mm] on each side.
/// @pre margin does not make it empty
Box enlarged(const Box& box, double margin);

}  // namespace hexmesh
