// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "hexmesh/geometry/solid.h"
#include "hexmesh/geometry/surface_tree.h"

namespace hexmesh {

/// Normals of faces, edges and corners such that their sign tells inside from outside: of corners the sum of those of
/// its faces by their angles there.
/// Source: Baerentzen, Aanaes, IEEE Trans. Vis. Comput. Graph. 11 (2005) 243.
struct Enclosed::Normals {
  explicit Normals(const TriangleSurface& s) : tree(s.points, s.triangles), of_point(s.points.size(), Vec3::Zero()) {
    std::map<std::pair<std::int32_t, std::int32_t>, Vec3> of_edge;
    const auto edge = [](std::int32_t a, std::int32_t b) { return std::pair(std::min(a, b), std::max(a, b)); };
    for (std::size_t t = 0; t < s.triangles.size(); ++t) {
      const Vec3 normal = tree.normal(t).normalized();
      const Triangle corners = tree.corners(t);
      for (std::size_t c = 0; c < 3; ++c) {
        const Vec3 one = (corners[(c + 1) % 3] - corners[c]).normalized();
        const Vec3 other = (corners[(c + 2) % 3] - corners[c]).normalized();
        of_point[as_size(s.triangles[t][c])] += std::acos(std::clamp(one.dot(other), -1.0, 1.0)) * normal;
        of_edge.try_emplace(edge(s.triangles[t][c], s.triangles[t][(c + 1) % 3]), Vec3::Zero()).first->second += normal;
      }
    }
    for (const auto& triangle : s.triangles)
      for (std::size_t c = 0; c < 3; ++c)  // the edge across from corner c
        of_edges.push_back(of_edge.at(edge(triangle[(c + 1) % 3], triangle[(c + 2) % 3])));
  }

  /// Of the face, edge or corner that a point of a triangle is of.
  Vec3 at(const Foot& foot, const std::array<std::int32_t, 3>& corners) const {
    constexpr double nothing = 1e-9;
    for (std::size_t c = 0; c < 3; ++c)
      if (foot.weights[static_cast<int>(c)] > 1 - nothing) return of_point[as_size(corners[c])];
    for (std::size_t c = 0; c < 3; ++c)
      if (foot.weights[static_cast<int>(c)] < nothing) return of_edges[3 * foot.triangle + c];
    return tree.normal(foot.triangle);
  }

  SurfaceTree tree;
  std::vector<Vec3> of_point;
  std::vector<Vec3> of_edges;  ///< shape (3 num_triangles)
};

Enclosed::Enclosed(TriangleSurface surface)
    : surface_(std::move(surface)), normals_(std::make_unique<Normals>(surface_)) {
  double area = 0;
  for (const double a : areas_of_points(surface_.points, surface_.triangles)) area += a;
  thickness_ = area > 0 ? 3 * std::abs(enclosed_volume(surface_)) / area : 0;  // of a ball its radius
}

Enclosed::~Enclosed() = default;

Gap Enclosed::gap(const Vec3& place) const {
  const Foot foot = normals_->tree.nearest(place);
  const Vec3 normal = normals_->at(foot, surface_.triangles[foot.triangle]).normalized(),
             from_foot = place - foot.place;
  if (foot.distance == 0) return {0, normal, Mat3::Zero()};
  const double side = from_foot.dot(normal) < 0 ? -1 : 1;
  return {side * foot.distance, side * from_foot / foot.distance, Mat3::Zero()};
}

}  // namespace hexmesh
