// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <numbers>

#include "hexmesh/core/error.h"
#include "hexmesh/core/memory.h"
#include "hexmesh/scan/phantom.h"

namespace hexmesh {
namespace {

using Sizes = std::map<std::string, double>;

/// Its box around the origin, and whether a point of that box belongs to it.
struct Solid {
  Vec3 extent;
  std::function<bool(const Vec3&)> contains;
};

/// Half open, so that centres on both of two opposite faces count once.
bool in_box(const Vec3& p, const Vec3& extent) {
  return (p.array() >= -extent.array() / 2).all() && (p.array() < extent.array() / 2).all();
}

Solid make_solid(const std::string& name, const Sizes& size) {
  const auto of = [&](const char* key) { return size.at(key); };
  if (name == "sphere") {
    const double radius = of("radius");
    return {Vec3::Constant(2 * radius), [=](const Vec3& p) { return p.norm() < radius; }};
  }
  if (name == "cylinder") {
    const double radius = of("radius"), height = of("height");
    return {{2 * radius, 2 * radius, height},
            [=](const Vec3& p) { return p.head<2>().norm() < radius && p[2] >= -height / 2 && p[2] < height / 2; }};
  }
  if (name == "line") {
    const Vec3 rod(of("length"), of("thickness"), of("thickness"));
    return {rod, [=](const Vec3& p) { return in_box(p, rod); }};
  }
  const Vec3 extent(of("length"), of("width"), of("height"));
  if (name == "c-shape") {
    // Open towards +x: a spine and two arms.
    const double arm = of("arm");
    return {extent, [=](const Vec3& p) {
              return in_box(p, extent) && (p[0] < -extent[0] / 2 + arm || std::abs(p[1]) >= extent[1] / 2 - arm);
            }};
  }
  return {extent, [=](const Vec3& p) { return in_box(p, extent); }};
}

Sizes sizes_of(const SolidPhantom& solid) {
  const auto known = solid_phantoms().find(solid.name);
  if (known == solid_phantoms().end()) throw Error(ErrorKind::usage, fmt::format("unknown phantom '{}'", solid.name));
  Sizes sizes = known->second;
  for (const auto& [key, value] : solid.size) {
    std::vector<std::string> names;
    for (const auto& [name, unused] : sizes) names.push_back(name);
    if (!sizes.contains(key))
      throw Error(ErrorKind::usage, fmt::format("phantom '{}' has no size '{}', expected one of: {}", solid.name, key,
                                                fmt::join(names, ", ")));
    if (!(std::isfinite(value) && value > 0))
      throw Error(ErrorKind::usage, fmt::format("phantom '{}': {} is {} mm, expected > 0", solid.name, key, value));
    sizes[key] = value;
  }
  return sizes;
}

}  // namespace

const std::map<std::string, std::map<std::string, double>>& solid_phantoms() {
  static const std::map<std::string, Sizes> solids = {
      {"beam", {{"length", 160}, {"width", 40}, {"height", 40}}},
      {"box", {{"length", 80}, {"width", 60}, {"height", 40}}},
      {"line", {{"length", 100}, {"thickness", 2}}},
      {"torsion-bar", {{"length", 20}, {"width", 20}, {"height", 120}}},
      {"sheet", {{"length", 100}, {"width", 100}, {"height", 3}}},
      {"cylinder", {{"radius", 50}, {"height", 60}}},
      {"sphere", {{"radius", 40}}},
      {"c-shape", {{"length", 64}, {"width", 64}, {"height", 16}, {"arm", 16}}},
  };
  return solids;
}

LabelVolume solid_phantom(const SolidPhantom& phantom) {
  if (!(phantom.spacing > 0)) throw Error(ErrorKind::usage, "phantom spacing is not > 0");
  const Solid solid = make_solid(phantom.name, sizes_of(phantom));
  constexpr double radians = std::numbers::pi / 180;
  const Mat3 rotation = (Eigen::AngleAxisd(phantom.rotation[2] * radians, Vec3::UnitZ()) *
                         Eigen::AngleAxisd(phantom.rotation[1] * radians, Vec3::UnitY()) *
                         Eigen::AngleAxisd(phantom.rotation[0] * radians, Vec3::UnitX()))
                            .toRotationMatrix();
  const Vec3 reach = rotation.cwiseAbs() * solid.extent / 2 + phantom.shift.cwiseAbs();
  // Voxel corners at the unmoved solid's lower corner plus whole voxels, with two voxels of margin.
  Index3 extent;
  Vec3 low;
  for (int d = 0; d < 3; ++d) {
    const double before = std::ceil((reach[d] - solid.extent[d] / 2) / phantom.spacing - 1e-9) + 2;
    low[d] = -solid.extent[d] / 2 - before * phantom.spacing;
    const double count = std::ceil((reach[d] - low[d]) / phantom.spacing) + 2;
    if (!(count < 65536)) throw Error(ErrorKind::usage, "the phantom has more than 65535 voxels along an axis");
    extent[d] = static_cast<std::int32_t>(count);
  }
  const Grid grid(extent, Vec3::Constant(phantom.spacing), low + Vec3::Constant(phantom.spacing / 2));
  expect_memory(grid.num_voxels() * sizeof(std::uint16_t), fmt::format("a phantom of {} voxels", grid.num_voxels()));
  LabelVolume volume{grid, std::vector<std::uint16_t>(grid.num_voxels()), {{1, phantom.name, {0.72, 0.35, 0.28}}}};
  for (std::size_t n = 0; n < volume.labels.size(); ++n) {
    const Index3 v = grid.index(n);
    const Vec3 p = grid.center(v) - phantom.shift;
    volume.labels[n] = solid.contains(rotation.transpose() * p);
  }
  return volume;
}

}  // namespace hexmesh
