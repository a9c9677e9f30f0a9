// SPDX-License-Identifier: Apache-2.0
#include "match/matching.h"

#include <fmt/format.h>

#include <algorithm>

#include "hexmesh/core/error.h"
#include "hexmesh/geometry/surface_tree.h"
#include "match/landmark_matching.h"
#include "match/surface_matching.h"

namespace hexsolver {
namespace {

using hexmesh::Lattice;
using hexmesh::LatticeSegment;

/// The segment whose surface a target is, or the only one with a material.
const LatticeSegment& segment_of(const Match& match, const Lattice& lattice) {
  const auto fail = [&](const std::string& what, const std::string& expected) {
    std::string names;
    for (const LatticeSegment& s : lattice.segments)
      if (s.material) names += (names.empty() ? "" : ", ") + s.segment.name;
    throw hexmesh::Error(hexmesh::ErrorKind::input,
                         fmt::format("{} {}, expected {}: {}", with_place("match", match), what, expected, names));
  };
  const LatticeSegment* found = nullptr;
  for (const LatticeSegment& s : lattice.segments) {
    if (!s.material || (!match.segment.empty() && s.segment.name != match.segment)) continue;
    if (found) fail("names no segment", "segment = one of");
    found = &s;
  }
  if (!found) fail(fmt::format("has segment '{}'", match.segment), "one with a material");
  return *found;
}

double area_of(const hexmesh::TriangleSurface& surface) {
  double area = 0;
  for (const double a : hexmesh::areas_of_points(surface.points, surface.triangles)) area += a;
  return area;
}

/// Mean of the segments, by volume [MPa].
double young_of(const Lattice& lattice) {
  double sum = 0, voxels = 0;
  for (const LatticeSegment& s : lattice.segments)
    if (s.material) {
      sum += static_cast<double>(s.num_voxels) * s.material->young;
      voxels += static_cast<double>(s.num_voxels);
    }
  return voxels > 0 ? sum / voxels : 0;
}

/// The distance that a match trusts where it names none: of the body's size.
double trust_of(const Match& match, const hexmesh::TriangleSurface& body) {
  constexpr double of_size = 1e-3;
  if (match.trust > 0) return match.trust;
  return of_size * size_of(body.points);
}

/// Which traction leaves the distance that a match trusts, over Young's modulus.
constexpr double traction = 0.1;
/// Of the body's surface, that a landmark stands for.
constexpr double of_landmark = 0.01;

}  // namespace

double size_of(const std::vector<Vec3>& points) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : points) box.extend(p);
  return points.empty() ? 0 : box.diagonal().norm();
}

Matchings make_matchings(const Scene& scene, const Lattice& lattice) {
  Matchings out;
  for (const Match& match : scene.matches) {
    if (match.is_of_landmarks()) {
      const double stiffness = traction * young_of(lattice) / trust_of(match, lattice.surface);
      out.push_back(std::make_shared<LandmarkMatching>(match, of_landmark * area_of(lattice.surface), stiffness));
      continue;
    }
    const LatticeSegment& segment = segment_of(match, lattice);
    hexmesh::TriangleSurface body = hexmesh::of_segment(lattice.surface, segment.segment.label);
    if (body.triangles.empty())
      throw hexmesh::Error(hexmesh::ErrorKind::input,
                           fmt::format("{}: segment '{}' has no picture surface, expected one to lie on the target",
                                       with_place("match", match), segment.segment.name));
    const double stiffness = traction * segment.material->young / trust_of(match, body);
    out.push_back(std::make_shared<SurfaceMatching>(match, std::move(body), stiffness));
  }
  return out;
}

}  // namespace hexsolver
