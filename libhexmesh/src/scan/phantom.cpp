// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/scan/phantom.h"

#include <fmt/format.h>

#include <cmath>

#include "hexmesh/core/error.h"
#include "hexmesh/core/memory.h"

namespace hexmesh {
namespace {

// Implicit functions [mm]: negative inside, near the distance close to the surface.

double ellipsoid(const Vec3& p, const Vec3& center, const Vec3& radii) {
  const Vec3 q = (p - center).cwiseQuotient(radii);
  const double k = q.norm();
  return k < 1e-9 ? -radii.minCoeff() : k * (k - 1) / q.cwiseQuotient(radii).norm();
}

double capsule(const Vec3& p, const Vec3& a, const Vec3& b, double radius_a, double radius_b) {
  const double t = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (p - a - t * (b - a)).norm() - (radius_a + t * (radius_b - radius_a));
}

/// Union with a fillet of about the given radius. Source: I. Quilez, "smooth minimum" (polynomial).
double smooth_union(double a, double b, double radius) {
  const double h = std::max(radius - std::abs(a - b), 0.0) / radius;
  return std::min(a, b) - h * h * radius / 4;
}

double smooth_difference(double a, double b, double radius) { return -smooth_union(-a, b, radius); }

double liver(const Vec3& p) {
  const double right = ellipsoid(p, {-45, 0, -2}, {55, 49, 49});
  const double left = ellipsoid(p, {42, -14, 12}, {58, 30, 27});
  const double lobes = smooth_union(right, left, 30);
  const double visceral = smooth_difference(lobes, ellipsoid(p, {8, 42, -48}, {52, 38, 40}), 20);
  return visceral;
}

double tumour(const Vec3& p) { return (p - Vec3(-58, -8, 12)).norm() - 13; }

double vessel(const Vec3& p) {
  const Vec3 hilum(-8, 10, -14), fork(-18, -2, 0);
  const double trunk = capsule(p, hilum, fork, 6.5, 6);
  const double to_right = capsule(p, fork, {-66, 14, -14}, 5.5, 3);
  const double to_left = capsule(p, fork, {52, -16, 12}, 5, 2.5);
  return std::min({trunk, to_right, to_left});
}

/// Noise in [-1, 1) from the voxel's number (splitmix64), the same on every machine.
double noise(std::uint64_t n) {
  n += 0x9e3779b97f4a7c15ULL;
  n = (n ^ (n >> 30)) * 0xbf58476d1ce4e5b9ULL;
  n = (n ^ (n >> 27)) * 0x94d049bb133111ebULL;
  return static_cast<double>((n ^ (n >> 31)) >> 11) * 0x1p-52 - 1;
}

float hounsfield(const Vec3& p, std::uint16_t label, std::uint64_t number) {
  double value = -1000;  // air
  const double torso = ellipsoid(p, {30, 20, 0}, {165, 95, 400});
  if (torso < 0) value = torso > -12 ? -100 : 45;                  // fat under the skin, soft tissue
  if (ellipsoid(p, {30, 82, 0}, {18, 20, 1000}) < 0) value = 350;  // spine
  if (label == 1) value = 110;
  if (label == 2) value = 55;
  if (label == 3) value = 190;
  return static_cast<float>(std::round(value + 12 * noise(number)));
}

}  // namespace

Phantom liver_phantom(double spacing) {
  if (!(spacing >= 0.25 && spacing <= 10))
    throw Error(ErrorKind::usage, fmt::format("phantom spacing is {} mm, expected 0.25 to 10", spacing));
  const Vec3 low(-145, -80, -62), high(205, 120, 62);
  Index3 extent;
  for (int d = 0; d < 3; ++d) extent[d] = static_cast<std::int32_t>(std::lround((high[d] - low[d]) / spacing));
  const Grid grid(extent, Vec3::Constant(spacing), low + Vec3::Constant(spacing / 2));

  constexpr std::size_t bytes_per_voxel = sizeof(std::uint16_t) + sizeof(float);
  expect_memory(bytes_per_voxel * grid.num_voxels(), fmt::format("a phantom of {} voxels", grid.num_voxels()));
  Phantom phantom{{grid, std::vector<std::uint16_t>(grid.num_voxels()), {}},
                  {grid, std::vector<float>(grid.num_voxels())}};
  phantom.labels.segments = {
      {1, "liver", {0.72, 0.35, 0.28}}, {2, "tumour", {0.95, 0.85, 0.25}}, {3, "vessel", {0.25, 0.45, 0.85}}};
  for (std::size_t n = 0; n < grid.num_voxels(); ++n) {
    const Index3 v = grid.index(n);
    const Vec3 p = grid.center(v);
    std::uint16_t label = 0;
    if (liver(p) < 0) label = tumour(p) < 0 ? 2 : vessel(p) < 0 ? 3 : 1;
    phantom.labels.labels[n] = label;
    phantom.intensity.values[n] = hounsfield(p, label, n);
  }
  return phantom;
}

}  // namespace hexmesh
