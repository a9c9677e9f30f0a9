// SPDX-License-Identifier: Apache-2.0
#include "match/matching.h"

#include <fmt/format.h>

#include <algorithm>

#include "hexmesh/core/error.h"
#include "match/landmark_matching.h"
#include "match/noise.h"
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
    if (found) fail("names no segment", "segment (hexfit: --body) = one of");
    found = &s;
  }
  if (!found) fail(fmt::format("has segment '{}'", match.segment), "one with a material");
  return *found;
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

/// The match with the distance that it trusts, where it names none: of landmarks of the body's size, of a surface half
/// of its noise, and not less than a part of the body's size.
Match with_trust(Match match, const Lattice& lattice) {
  constexpr double of_landmarks = 1e-3, of_surface = 5e-4, of_noise = 0.5;
  if (match.trust > 0) return match;
  match.trust = match.is_of_landmarks() ? of_landmarks * size_of(lattice)
                                        : std::max(of_surface * size_of(lattice), of_noise * noise_of(match.target));
  return match;
}

/// Landmarks that alone hold a body in space.
void expect_holding(const Scene& scene) {
  if (scene.matches.empty() || !scene.conditions.empty()) return;
  std::vector<Vec3> points;
  for (const Match& m : scene.matches) {
    if (!m.is_of_landmarks()) return;
    points.insert(points.end(), m.from.begin(), m.from.end());
  }
  double width = 0;  // beside the line through the two that are farthest from each other
  const auto far_from = [&](const Vec3& p) {
    return *std::max_element(points.begin(), points.end(), [&](const Vec3& a, const Vec3& b) {
      return (a - p).squaredNorm() < (b - p).squaredNorm();
    });
  };
  const Vec3 a = far_from(points.front()), b = far_from(a);
  for (const Vec3& p : points) width = std::max(width, (p - a).cross((b - a).normalized()).norm());
  if (constexpr double least = 1e-3; width > least * (b - a).norm()) return;
  throw hexmesh::Error(hexmesh::ErrorKind::geometry,
                       fmt::format("{} has {} in line, expected three or more that are not, or a surface or supports "
                                   "beside them",
                                   with_place("match", scene.matches.front()),
                                   points.size() == 1 ? "1 point" : fmt::format("{} points", points.size())));
}

/// Which traction leaves the distance that a match trusts, over Young's modulus.
constexpr double traction = 0.1;
/// Of the body's size, the edge of the square that a landmark stands for: about a hundredth of the surface.
constexpr double of_landmark = 1.0 / 8;

}  // namespace

double size_of(const Lattice& lattice) {
  const Index3& n = lattice.voxels.extent();
  return lattice.voxels.spacing().cwiseProduct(Vec3(n[0], n[1], n[2])).norm();
}

Matchings make_matchings(const Scene& scene, const Lattice& lattice) {
  constexpr double most = 1e6;  // mm
  expect_holding(scene);
  Matchings out;
  for (const Match& asked : scene.matches) {
    Match match = asked;
    match.target = hexmesh::merged(match.target);
    match = with_trust(std::move(match), lattice);
    for (const std::vector<Vec3>* places : {&match.target.points, &match.to})
      for (const Vec3& p : *places)
        if (!(p.cwiseAbs().maxCoeff() <= most))
          throw hexmesh::Error(hexmesh::ErrorKind::input,
                               fmt::format("{} has a point at [{:g}, {:g}, {:g}] mm, expected within {:g} mm",
                                           with_place("match", match), p[0], p[1], p[2], most));
    if (match.is_of_landmarks()) {
      const double stiffness = traction * young_of(lattice) / match.trust;
      const double edge = of_landmark * size_of(lattice);
      out.push_back(std::make_shared<LandmarkMatching>(match, edge * edge, stiffness, size_of(lattice)));
      continue;
    }
    const LatticeSegment& segment = segment_of(match, lattice);
    hexmesh::TriangleSurface body = hexmesh::of_segment(lattice.surface, segment.segment.label);
    if (body.triangles.empty())
      throw hexmesh::Error(hexmesh::ErrorKind::input,
                           fmt::format("{}: segment '{}' has no picture surface, expected one to lie on the target",
                                       with_place("match", match), segment.segment.name));
    const double stiffness = traction * segment.material->young / match.trust;
    out.push_back(std::make_shared<SurfaceMatching>(match, std::move(body), stiffness, size_of(lattice)));
  }
  return out;
}

}  // namespace hexsolver
