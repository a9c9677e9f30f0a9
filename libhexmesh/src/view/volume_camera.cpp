// SPDX-License-Identifier: Apache-2.0
#include "volume_camera.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace hexmesh {
namespace {

constexpr double margin = 1.05;  // of the picture around the body

}  // namespace

VolumeCamera::VolumeCamera(const Bounds& b, const VolumeOptions& options) {
  view = options.view.normalized();
  right = view.cross(options.up).normalized();
  down = view.cross(right);
  center = (b.low + b.high) / 2;
  near = std::numeric_limits<double>::infinity();
  far = -near;
  double across = 0, along = 0;  // half sizes on the picture
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 p;
    for (int d = 0; d < 3; ++d) p[d] = (corner_bit(corner, d) == 1 ? b.high[d] : b.low[d]) - center[d];
    near = std::min(near, view.dot(p));
    far = std::max(far, view.dot(p));
    across = std::max(across, std::abs(right.dot(p)));
    along = std::max(along, std::abs(down.dot(p)));
  }
  pixel = 2 * margin * std::max(across / options.width, along / options.height);
  // In perspective a pixel is that large in front of the body.
  if (options.perspective > 0)
    focal = pixel * options.height / 2 / std::tan(options.perspective * std::numbers::pi / 360);
}

}  // namespace hexmesh
