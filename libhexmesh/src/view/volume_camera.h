// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/view/volume.h"

namespace hexmesh {

/// Where a picture of a volume is seen from.
struct VolumeCamera {
  /// @param bounds  of the body, which the picture holds
  VolumeCamera(const Bounds& bounds, const VolumeOptions& options);

  /// A vector's components along the picture's rows, its columns and the view.
  Vec3 seen(const Vec3& v) const { return {right.dot(v), down.dot(v), view.dot(v)}; }

  /// Distance between two of that many planes across the view [mm].
  double plane_distance(int planes) const { return (far - near) / planes; }

  Vec3 right, down, view, center;  ///< positions are taken from the centre
  double near = 0, far = 1;        ///< depths of the body along the view [mm]
  double pixel = 1;                ///< [mm] on the picture's plane
  double focal = 0;                ///< distance of the eye from where a pixel is that large [mm]; 0 = orthographic
};

}  // namespace hexmesh
