// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/warp/bounds.h"

#include <limits>

#include "solid.h"

namespace hexmesh {

Bounds bounds_of(const Result& result) {
  Bounds b{Vec3::Constant(std::numeric_limits<double>::infinity()),
           Vec3::Constant(-std::numeric_limits<double>::infinity())};
  const Vec3 half = (result.voxels.direction() * result.voxels.spacing().asDiagonal()).cwiseAbs().rowwise().sum() / 2;
  // The voxels rather than the nodes: those of slivers move without meaning.
  for_each_voxel(result, [&](const Vec3& rest, const Vec3& u) {
    b.low = b.low.cwiseMin(rest - half).cwiseMin(rest + u - half);
    b.high = b.high.cwiseMax(rest + half).cwiseMax(rest + u + half);
  });
  return b;
}

}  // namespace hexmesh
