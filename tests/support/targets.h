// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "hexmesh/lattice/surface_faces.h"
#include "hexsolver/scene/scene.h"
#include "support/bodies.h"

namespace testing_support {

using hexsolver::Match;

/// The exposed faces of voxels, two triangles each, seen from outside.
inline hexmesh::TriangleSurface surface_of(const Lattice& lattice) {
  hexmesh::TriangleSurface out;
  std::map<Index3, std::int32_t> numbers;
  for (const hexmesh::ExposedFace& face : hexmesh::exposed_faces(lattice)) {
    const std::size_t axis = face.side / 2;
    std::array<std::int32_t, 4> corners{};
    for (std::size_t n = 0; n < 4; ++n) {
      Index3 corner = face.voxel;
      corner[axis] += face.side % 2;
      corner[(axis + 1) % 3] += n == 1 || n == 2;
      corner[(axis + 2) % 3] += n >= 2;
      const auto [entry, is_new] = numbers.try_emplace(corner, static_cast<std::int32_t>(out.points.size()));
      if (is_new) out.points.push_back(lattice.voxels.position(Vec3(corner[0], corner[1], corner[2]).array() - 0.5));
      corners[n] = entry->second;
    }
    if (face.side % 2 == 0) std::swap(corners[1], corners[3]);
    out.triangles.push_back({corners[0], corners[1], corners[2]});
    out.triangles.push_back({corners[0], corners[2], corners[3]});
  }
  out.segment.assign(out.triangles.size(), 1);
  return out;
}

/// A body like no turned one of itself.
inline Lattice crooked_body(double poisson = 0.45) {
  Lattice lattice = one_material(
      {16, 10, 8}, {2, 2, 2}, [](const Index3& n) { return n[1] < 5 || n[0] < 5 || (n[0] > 12 && n[2] < 4); }, 3,
      poisson);
  lattice.surface = surface_of(lattice);
  return lattice;
}

inline Eigen::Isometry3d turned(double degrees, const Vec3& axis, const Vec3& shift) {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.linear() = Eigen::AngleAxisd(degrees * std::acos(-1.0) / 180, axis.normalized()).toRotationMatrix();
  motion.translation() = shift;
  return motion;
}

inline Match match_to(hexmesh::TriangleSurface target) {
  Match m;
  m.name = m.where = "now";
  m.target = std::move(target);
  m.trust = 0.5;
  return m;
}

template <class F>
hexmesh::TriangleSurface moved(hexmesh::TriangleSurface surface, const F& to) {
  for (Vec3& p : surface.points) p = to(p);
  return surface;
}

/// Stretched, bent and shifted.
inline Vec3 bent(const Vec3& p) { return {1.05 * p[0] + 0.4, p[1] + 2e-3 * p[0] * p[0] - 0.3, 0.97 * p[2] + 0.6}; }

}  // namespace testing_support
