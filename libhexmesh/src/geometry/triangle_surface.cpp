// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/geometry/triangle_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <set>

#include "hexmesh/core/partition.h"

namespace hexmesh {

void add_triangle(TriangleSurface& to, const TriangleSurface& from, std::size_t triangle,
                  std::vector<std::int32_t>& number) {
  std::array<std::int32_t, 3> corners = from.triangles[triangle];
  for (std::int32_t& n : corners) {
    std::int32_t& mapped = number[n];
    if (mapped < 0) {
      mapped = static_cast<std::int32_t>(to.points.size());
      to.points.push_back(from.points[n]);
    }
    n = mapped;
  }
  to.triangles.push_back(corners);
  if (!from.segment.empty()) to.segment.push_back(from.segment[triangle]);
}

TriangleSurface of_segment(const TriangleSurface& surface, std::uint16_t label) {
  TriangleSurface out;
  std::vector<std::int32_t> number(surface.points.size(), -1);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
    if (surface.segment[t] == label) add_triangle(out, surface, t, number);
  return out;
}

double enclosed_volume(const TriangleSurface& surface) {
  if (surface.points.empty()) return 0;
  // Against the first point, so that little is lost far from the origin.
  const Vec3 base = surface.points.front();
  double volume = 0;
  for (const auto& [a, b, c] : surface.triangles) {
    const auto p = [&](std::int32_t n) -> Vec3 { return surface.points[n] - base; };
    volume += p(a).dot(p(b).cross(p(c))) / 6;
  }
  return volume;
}

std::size_t count_open_edges(const TriangleSurface& surface) {
  std::map<std::pair<std::int32_t, std::int32_t>, int> balance;  // low to high point counts 1, back -1
  for (const auto& t : surface.triangles)
    for (std::size_t a = 0; a < 3; ++a) {
      const std::int32_t from = t[a], to = t[(a + 1) % 3];
      balance[std::minmax(from, to)] += from < to ? 1 : -1;
    }
  return static_cast<std::size_t>(
      std::count_if(balance.begin(), balance.end(), [](const auto& edge) { return edge.second != 0; }));
}

Edges edges_of(const TriangleSurface& surface) {
  std::map<std::pair<std::int32_t, std::int32_t>, int> triangles;
  for (const auto& t : surface.triangles)
    for (std::size_t a = 0; a < 3; ++a) ++triangles[std::minmax(t[a], t[(a + 1) % 3])];
  const auto is_open = [](const auto& edge) { return edge.second % 2 != 0; };
  return {triangles.size(), static_cast<std::size_t>(std::count_if(triangles.begin(), triangles.end(), is_open))};
}

std::vector<std::int32_t> pieces_of(const TriangleSurface& surface) {
  Partition pieces(surface.points.size());
  for (const auto& t : surface.triangles) {
    pieces.join(t[0], t[1]);
    pieces.join(t[0], t[2]);
  }
  std::vector<std::int32_t> out;
  for (std::size_t n = 0; n < surface.points.size(); ++n) out.push_back(pieces.root(static_cast<std::int32_t>(n)));
  return out;
}

TriangleSurface merged(const TriangleSurface& surface) {
  struct Less {
    bool operator()(const Vec3& a, const Vec3& b) const {
      return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
    }
  };
  TriangleSurface out;
  std::map<Vec3, std::int32_t, Less> number;
  std::set<std::array<std::int32_t, 3>> there;
  for (std::array<std::int32_t, 3> t : surface.triangles) {
    for (std::int32_t& n : t) {
      const Vec3& p = surface.points[n];
      const auto [at, added] = number.emplace(p, static_cast<std::int32_t>(out.points.size()));
      if (added) out.points.push_back(p);
      n = at->second;
    }
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    const auto p = [&](std::size_t a) -> Vec3 { return out.points[t[a]]; };
    if ((p(1) - p(0)).cross(p(2) - p(0)).norm() > 0 && there.insert(t).second) out.triangles.push_back(t);
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
