// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "hexmesh/geometry/solid.h"
#include "hexmesh/geometry/surface_tree.h"

namespace hexmesh {

namespace {

/// The triangles of a piece, on all the points.
TriangleSurface piece_of(const TriangleSurface& surface, const std::vector<std::int32_t>& pieces, std::int32_t piece) {
  TriangleSurface out;
  out.points = surface.points;
  for (const auto& t : surface.triangles)
    if (pieces[as_size(t[0])] == piece) out.triangles.push_back(t);
  return out;
}

double size_of(const TriangleSurface& surface) {
  Vec3 low = surface.points.front(), high = low;
  for (const Vec3& p : surface.points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return (high - low).norm();
}

}  // namespace

std::string fault_of_solid(const TriangleSurface& surface) {
  constexpr double least_part = 1e-7;  // of the cube around it
  if (const std::size_t open = edges_of(surface).open; open > 0)
    return fmt::format("has {} edges with a triangle on one side only, expected a closed surface", open);
  if (const std::size_t uneven = count_open_edges(surface); uneven > 0)
    return fmt::format("has {} edges whose triangles face different ways, expected all outwards", uneven);
  if (surface.triangles.empty()) return "has no triangles, expected a closed surface";
  if (const double volume = enclosed_volume(surface); std::abs(volume) < least_part * std::pow(size_of(surface), 3))
    return fmt::format("encloses {:.3g} mm^3, expected more beside its size", std::abs(volume));
  struct Piece {
    double volume;
    Vec3 point;
    std::unique_ptr<const Enclosed> outwards;
  };
  std::vector<Piece> pieces;
  const std::vector<std::int32_t> names = pieces_of(surface);
  for (const std::int32_t name : std::set<std::int32_t>(names.begin(), names.end())) {
    TriangleSurface piece = piece_of(surface, names, name);
    if (piece.triangles.empty()) continue;
    const double volume = enclosed_volume(piece);
    if (volume < 0)
      for (auto& t : piece.triangles) std::swap(t[1], t[2]);
    const Vec3 point = piece.points[as_size(piece.triangles[0][0])];
    pieces.push_back({volume, point, std::make_unique<const Enclosed>(std::move(piece))});
  }
  for (const Piece& piece : pieces) {
    const auto around = std::count_if(pieces.begin(), pieces.end(), [&](const Piece& other) {
      return &other != &piece && other.outwards->gap(piece.point).depth < 0;
    });
    if ((piece.volume > 0) != (around % 2 == 0))
      return "is inside out in part or all of it, expected triangles counter-clockwise seen from outside";
  }
  return {};
}

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
