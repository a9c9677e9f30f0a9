// SPDX-License-Identifier: Apache-2.0
#include "volume_texture.h"

#include <algorithm>
#include <cmath>

#include "hexmesh/view/grey_window.h"

namespace hexmesh {
namespace {

constexpr double full = VolumeTexture::full, full_normal = VolumeTexture::full_normal;
constexpr double darkest = 0.6;  // of a colour at the dark end of the grey window

/// Colours, and opacities for the number of planes that there are.
std::map<std::uint16_t, Appearance> appearance_in(const Result& result, const VolumeOptions& options) {
  std::map<std::uint16_t, Appearance> appearance = default_appearance(result);
  for (const auto& [label, look] : options.appearance) appearance[label] = look;
  const double share = static_cast<double>(reference_planes) / options.planes;
  for (auto& [label, look] : appearance)
    look.opacity = options.linear_opacity ? std::min(1.0, look.opacity * share) : 1 - std::pow(1 - look.opacity, share);
  return appearance;
}

VolumeTexture classified(const Result& result, const IntensityVolume* scan, const VolumeOptions& options) {
  const std::map<std::uint16_t, Appearance> appearance = appearance_in(result, options);
  VolumeTexture texture;
  texture.most_opaque = 1e-12;
  for (const auto& [label, look] : appearance) texture.most_opaque = std::max(texture.most_opaque, look.opacity);
  std::optional<GreyWindow> window;
  if (scan) window = grey_window(result, *scan, options.level, options.window);

  for (std::size_t d = 0; d < 3; ++d) texture.size[d] = result.voxels.extent()[d] + 2;
  texture.texels.resize(count_in(texture.size));
  const Index3& n = result.voxels.extent();
#pragma omp parallel for schedule(static)
  for (std::int32_t k = 0; k < n[2]; ++k)
    for (std::int32_t j = 0; j < n[1]; ++j)
      for (std::int32_t i = 0; i < n[0]; ++i) {
        const auto look = appearance.find(result.labels[result.voxels.offset({i, j, k})]);
        if (look == appearance.end()) continue;
        double brightness = 1;
        if (scan) {
          const double value = value_at(*scan, result.voxels.center({i, j, k}));
          brightness = std::isnan(value) ? darkest : darkest + (1 - darkest) * window->brightness(value);
        }
        VolumeTexture::Texel& texel = texture.texels[offset_in(texture.size, {i + 1, j + 1, k + 1})];
        const double opacity = look->second.opacity;
        for (std::size_t c = 0; c < 3; ++c)
          texel.rgba[c] = static_cast<std::uint16_t>(std::lround(full * opacity / texture.most_opaque * brightness *
                                                                 std::clamp(look->second.color[c], 0.0, 1.0)));
        texel.rgba[3] = static_cast<std::uint16_t>(std::lround(full * opacity / texture.most_opaque));
      }
  return texture;
}

/// Central differences of the opacity over five voxels, so that the steps between voxels do not show.
void find_normals(const Vec3& spacing, VolumeTexture& texture) {
  const Index3& size = texture.size;
  texture.normals.resize(texture.texels.size());
  constexpr int reach = 2;
  const Vec3 per_mm = spacing.minCoeff() * spacing.cwiseInverse();  // at most 1
  double largest = 1;
  for (const VolumeTexture::Texel& t : texture.texels) largest = std::max<double>(largest, t.rgba[3]);
#pragma omp parallel for schedule(static)
  for (std::int32_t k = 0; k < size[2]; ++k)
    for (std::int32_t j = 0; j < size[1]; ++j)
      for (std::int32_t i = 0; i < size[0]; ++i) {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        double weights = 0;
        for (int c = std::max(-reach, -k); c <= std::min(reach, size[2] - 1 - k); ++c)
          for (int b = std::max(-reach, -j); b <= std::min(reach, size[1] - 1 - j); ++b)
            for (int a = std::max(-reach, -i); a <= std::min(reach, size[0] - 1 - i); ++a) {
              const double weight = 1.0 / (1 + a * a + b * b + c * c);
              sum -= weight * texture.texels[offset_in(size, {i + a, j + b, k + c})].rgba[3] * Eigen::Vector3d(a, b, c);
              weights += weight;
            }
        const Eigen::Vector3d normal = (sum / (weights * largest) * full_normal).cwiseProduct(per_mm);
        auto& stored = texture.normals[offset_in(size, {i, j, k})].xyz0;
        for (std::size_t d = 0; d < 3; ++d)
          stored[d] = static_cast<std::int16_t>(std::clamp(normal[d], -full_normal, full_normal));
      }
}

}  // namespace

VolumeTexture make_texture(const Result& result, const IntensityVolume* scan, const VolumeOptions& options) {
  VolumeTexture texture = classified(result, scan, options);
  if (options.shaded) find_normals(result.voxels.spacing(), texture);
  return texture;
}

}  // namespace hexmesh
