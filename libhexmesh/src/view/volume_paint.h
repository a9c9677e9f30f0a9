// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "volume_planes.h"
#include "volume_texture.h"

namespace hexmesh {

/// Colours times opacities, and opacities, as blended so far; rows from the top.
struct BlendedPicture {
  int width, height;
  std::vector<std::array<float, 4>> pixels;

  BlendedPicture(int w, int h) : width(w), height(h), pixels(as_size(w) * as_size(h)) {}
};

/// Blends a plane over the rows [first_row, last_row] of a picture of what is behind it.
void paint(const VolumePlane& plane, const VolumeTexture& texture, int first_row, int last_row,
           BlendedPicture& picture);

}  // namespace hexmesh
