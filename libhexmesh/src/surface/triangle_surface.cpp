// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/surface/triangle_surface.h"

namespace hexmesh {

TriangleSurface of_segment(const TriangleSurface& surface, std::uint16_t label) {
  TriangleSurface out;
  std::vector<std::int32_t> number(surface.points.size(), -1);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    if (surface.segment[t] != label) continue;
    std::array<std::int32_t, 3> triangle = surface.triangles[t];
    for (std::int32_t& n : triangle) {
      std::int32_t& mapped = number[static_cast<std::size_t>(n)];
      if (mapped < 0) {
        mapped = static_cast<std::int32_t>(out.points.size());
        out.points.push_back(surface.points[static_cast<std::size_t>(n)]);
      }
      n = mapped;
    }
    out.triangles.push_back(triangle);
    out.segment.push_back(label);
  }
  return out;
}

void append(TriangleSurface& to, const TriangleSurface& surface) {
  const auto first = static_cast<std::int32_t>(to.points.size());
  to.points.insert(to.points.end(), surface.points.begin(), surface.points.end());
  for (const auto& [a, b, c] : surface.triangles) to.triangles.push_back({first + a, first + b, first + c});
  to.segment.insert(to.segment.end(), surface.segment.begin(), surface.segment.end());
}

}  // namespace hexmesh
