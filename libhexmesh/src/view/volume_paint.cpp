// SPDX-License-Identifier: Apache-2.0
#include "volume_paint.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace hexmesh {
namespace {

constexpr float ambient = 0.55F, diffuse = 0.75F;

using Corner = VolumePlane::Corner;
using Float4 = float __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));
using Short4 = std::uint16_t __attribute__((vector_size(8)));
using SignedShort4 = std::int16_t __attribute__((vector_size(8)));

// Inlined into paint(), whose clones are for more than one kind of processor.
template <class Packed>
[[gnu::always_inline]] inline Float4 unpack(const unsigned char* from) {
  Packed packed;
  std::memcpy(&packed, from, sizeof(packed));
  return __builtin_convertvector(__builtin_convertvector(packed, Int4),
                                 Float4);  // no one step is as fast with GCC 12
}

/// Linear between two neighbours.
template <class Packed>
[[gnu::always_inline]] inline Float4 along_row(const unsigned char* from, float x) {
  const Float4 a = unpack<Packed>(from), b = unpack<Packed>(from + sizeof(Packed));
  return a + x * (b - a);
}

/// Trilinear between the eight texels at `base`.
template <class Packed>
[[gnu::always_inline]] inline Float4 interpolate(const unsigned char* base, std::ptrdiff_t row, std::ptrdiff_t layer,
                                                 Float4 share) {
  const float x = share[0];
  const Float4 a = along_row<Packed>(base, x), b = along_row<Packed>(base + row, x);
  const Float4 c = along_row<Packed>(base + layer, x), d = along_row<Packed>(base + layer + row, x);
  const Float4 low = a + share[1] * (b - a), high = c + share[1] * (d - c);
  return low + share[2] * (high - low);
}

/// Blends a triangle over those rows of the picture, at the centres of its pixels. A pixel on an edge belongs to one of
/// the two triangles there.
template <bool shaded>
[[gnu::always_inline]] inline void paint_triangle(const Corner& a, const Corner& b, const Corner& c,
                                                  const std::array<float, 3>& light, const VolumeTexture& texture,
                                                  int first_row, int last_row, BlendedPicture& picture) {
  const Corner *top = &a, *middle = &b, *bottom = &c;
  const auto above = [](const Corner* p, const Corner* q) { return p->y < q->y || (p->y == q->y && p->x < q->x); };
  if (above(middle, top)) std::swap(top, middle);
  if (above(bottom, middle)) std::swap(middle, bottom);
  if (above(middle, top)) std::swap(top, middle);

  const float area = (middle->x - top->x) * (bottom->y - top->y) - (bottom->x - top->x) * (middle->y - top->y);
  if (!(std::abs(area) > 0) || !std::isfinite(area)) return;
  const auto place_of = [](const Corner& corner) {
    return Float4{corner.texture[0], corner.texture[1], corner.texture[2], 0};
  };
  const Float4 start = place_of(*top), p = place_of(*middle) - start, q = place_of(*bottom) - start;
  const Float4 along_x = (p * (bottom->y - top->y) - q * (middle->y - top->y)) / area;
  const Float4 along_y = (q * (middle->x - top->x) - p * (bottom->x - top->x)) / area;
  const auto before_end = [](std::int32_t size) { return static_cast<float>(size) - 1.001F; };
  const Float4 last = {before_end(texture.size[0]), before_end(texture.size[1]), before_end(texture.size[2]), 0};
  const auto edge = [](const Corner& from, const Corner& to, float y) {
    return to.y > from.y ? from.x + (y - from.y) * (to.x - from.x) / (to.y - from.y) : from.x;
  };
  const std::ptrdiff_t row_bytes = texture.size[0] * static_cast<std::ptrdiff_t>(sizeof(VolumeTexture::Texel));
  const std::ptrdiff_t layer_bytes = row_bytes * texture.size[1];
  const auto* texels = reinterpret_cast<const unsigned char*>(texture.texels.data());
  const auto* normals = reinterpret_cast<const unsigned char*>(texture.normals.data());
  const auto unit = static_cast<float>(texture.most_opaque / VolumeTexture::full);

  // Corners may be anywhere: those of slivers move without meaning.
  const auto pixel_from = [](float place, int size) {
    return static_cast<int>(std::clamp(std::ceil(place), 0.0F, static_cast<float>(size)));
  };
  const int first = std::max(first_row, pixel_from(top->y, picture.height));
  const int end = std::min(last_row, pixel_from(bottom->y, picture.height) - 1);
  for (int row = first; row <= end; ++row) {
    const auto y = static_cast<float>(row);
    const float x0 = edge(*top, *bottom, y);
    const float x1 = y < middle->y ? edge(*top, *middle, y) : edge(*middle, *bottom, y);
    const int left = pixel_from(std::min(x0, x1), picture.width);
    const int right = pixel_from(std::max(x0, x1), picture.width);
    std::array<float, 4>* pixel = picture.pixels.data() + static_cast<std::ptrdiff_t>(row) * picture.width + left;
    const Float4 at_row = start + (y - top->y) * along_y;
    for (int column = left; column < right; ++column, ++pixel) {
      Float4 place = at_row + (static_cast<float>(column) - top->x) * along_x;
      place = place > 0 ? place : Float4{};
      place = place < last ? place : last;
      const Int4 base = __builtin_convertvector(place, Int4);
      const Float4 share = place - __builtin_convertvector(base, Float4);
      const std::ptrdiff_t offset = base[0] * static_cast<std::ptrdiff_t>(sizeof(VolumeTexture::Texel)) +
                                    base[1] * row_bytes + base[2] * layer_bytes;
      Float4 color = unit * interpolate<Short4>(texels + offset, row_bytes, layer_bytes, share);
      const float opacity = color[3];
      if (!(opacity > 0)) continue;
      if constexpr (shaded) {
        const Float4 normal = interpolate<SignedShort4>(normals + offset, row_bytes, layer_bytes, share);
        const float length = std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
        // The steeper the opacity, the more of a surface it is; inside there is none to be lit.
        const float surface = std::min(1.0F, length * (4 / static_cast<float>(VolumeTexture::full_normal)));
        const float cosine =
            (normal[0] * light[0] + normal[1] * light[1] + normal[2] * light[2]) / std::max(length, 1e-6F);
        const float lit = 1 + surface * (ambient + diffuse * std::max(0.0F, cosine) - 1);
        color *= lit;
        color[3] = opacity;
      }
      Float4 behind;
      std::memcpy(&behind, pixel, sizeof(behind));
      const Float4 blended = color + (1 - opacity) * behind;
      std::memcpy(pixel, &blended, sizeof(blended));
    }
  }
}

}  // namespace

__attribute__((target_clones("arch=x86-64-v3", "default"))) void paint(const VolumePlane& plane,
                                                                       const VolumeTexture& texture, int first_row,
                                                                       int last_row, BlendedPicture& picture) {
  const bool shaded = !texture.normals.empty();
  for (const VolumePlane::Polygon& polygon : plane.polygons) {
    if (polygon.bottom < static_cast<float>(first_row) || polygon.top > static_cast<float>(last_row)) continue;
    const Corner* corners = &plane.corners[polygon.first];
    for (std::int32_t n = 1; n < polygon.count; ++n) {
      const Corner &b = corners[n], &c = corners[n + 1 < polygon.count ? n + 1 : 1];
      if (shaded)
        paint_triangle<true>(corners[0], b, c, polygon.light, texture, first_row, last_row, picture);
      else
        paint_triangle<false>(corners[0], b, c, polygon.light, texture, first_row, last_row, picture);
    }
  }
}

}  // namespace hexmesh
