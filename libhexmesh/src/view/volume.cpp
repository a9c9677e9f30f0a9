// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/view/volume.h"

#include <algorithm>
#include <cmath>

#include "volume_camera.h"
#include "volume_paint.h"
#include "volume_planes.h"
#include "volume_texture.h"

namespace hexmesh {
namespace {

constexpr int planes_at_a_time = 32;
constexpr int rows_at_a_time = 16;

/// The picture over a background.
Canvas over(const BlendedPicture& picture, const Rgb& background) {
  Canvas canvas(picture.width, picture.height);
  auto pixel = picture.pixels.begin();
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x, ++pixel) {
      const std::array<float, 4>& p = *pixel;
      for (std::size_t c = 0; c < 3; ++c)
        canvas.at(x, y)[c] = static_cast<std::uint8_t>(
            std::lround(std::clamp(255 * p[c] + (1 - p[3]) * static_cast<float>(background[c]), 0.0F, 255.0F)));
    }
  return canvas;
}

}  // namespace

std::map<std::uint16_t, Appearance> default_appearance(const Result& result, bool see_through) {
  std::map<std::uint16_t, Appearance> out;
  std::size_t most = 0;
  for (const LatticeSegment& s : result.segments)
    if (s.material) most = std::max(most, s.num_voxels);
  for (const LatticeSegment& s : result.segments)
    if (s.material)
      out[s.segment.label] = {s.segment.color, !see_through           ? opaque
                                               : s.num_voxels == most ? translucent
                                                                      : 5 * translucent};
  return out;
}

VolumeRenderer::VolumeRenderer(const Result& result, const IntensityVolume* scan, const VolumeOptions& options)
    : result_(result),
      options_(options),
      texture_(std::make_unique<VolumeTexture>(make_texture(result, scan, options))),
      camera_(std::make_unique<VolumeCamera>(bounds_of(result), options)) {}

VolumeRenderer::~VolumeRenderer() = default;

double VolumeRenderer::plane_distance() const { return camera_->plane_distance(options_.planes); }

Canvas VolumeRenderer::draw(const std::vector<Vec3>& displacement) const {
  const PlaneCutter cutter(result_, *camera_, options_);
  const SeenCells seen = cutter.see(displacement);
  const std::vector<std::vector<std::int32_t>> cells = cutter.cells_of_planes(seen);

  BlendedPicture picture(options_.width, options_.height);
  std::vector<VolumePlane> cuts(planes_at_a_time);
  for (int first = 0; first < options_.planes; first += planes_at_a_time) {
    const int count = std::min(planes_at_a_time, options_.planes - first);
#pragma omp parallel for schedule(dynamic, 1)
    for (int n = 0; n < count; ++n) cutter.cut(seen, first + n, cells[first + n], cuts[n]);
#pragma omp parallel for schedule(dynamic, 1)
    for (int row = 0; row < options_.height; row += rows_at_a_time)
      for (int n = 0; n < count; ++n)
        paint(cuts[n], *texture_, row, std::min(row + rows_at_a_time, options_.height) - 1, picture);
  }
  return over(picture, options_.background);
}

}  // namespace hexmesh
