// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "hexmesh/view/volume.h"

namespace hexmesh {

/// The classified voxels of a body, with one clear layer around: voxel (0, 0, 0) is texel (1, 1, 1).
struct VolumeTexture {
  static constexpr double full = 65535;         ///< stands for 1 in texels
  static constexpr double full_normal = 32767;  ///< likewise in normals

  struct Texel {
    std::array<std::uint16_t, 4> rgba;  ///< colour times opacity, opacity; of most_opaque
  };
  struct Normal {
    std::array<std::int16_t, 4> xyz0;  ///< against the gradient of the opacity, per smallest voxel edge; of at most 1
  };

  Index3 size;
  std::vector<Texel> texels;    ///< shape (count_in(size)), i fastest
  std::vector<Normal> normals;  ///< likewise; empty where nothing is shaded
  double most_opaque = 1;       ///< opacity of a plane of the most opaque segment
};

/// @param scan  without it all of a segment has one colour
VolumeTexture make_texture(const Result& result, const IntensityVolume* scan, const VolumeOptions& options);

}  // namespace hexmesh
