// SPDX-License-Identifier: Apache-2.0
#include "experiments.h"

#include <cmath>
#include <numbers>

#include "hexmesh/lattice/embedded_points.h"
#include "hexmesh/scan/phantom.h"

namespace hextools {

using hexmesh::Lattice;
using hexmesh::Vec3;
using hexsolver::Condition;
using hexsolver::SurfacePoints;

hexmesh::LabelVolume solid(const std::string& name, double spacing, const std::map<std::string, double>& size) {
  hexmesh::SolidPhantom s;
  s.name = name;
  s.spacing = spacing;
  s.size = size;
  return hexmesh::solid_phantom(s);
}

Lattice lattice_of(hexmesh::LabelVolume volume, double young_kpa, double poisson,
                   const hexmesh::LatticeOptions& options) {
  volume.segments.resize(1);
  for (std::uint16_t& label : volume.labels)
    if (label != volume.segments[0].label) label = 0;
  return hexmesh::build_lattice(
      volume, {{volume.segments[0], hexmesh::material_from_units(young_kpa, poisson, 1000), 0, "the experiment"}},
      options);
}

Lattice liver_of_phantom(double spacing, double poisson, const hexmesh::Index3& offset) {
  hexmesh::LabelVolume volume = hexmesh::liver_phantom(spacing).labels;
  for (std::uint16_t& label : volume.labels)
    if (label != 0) label = volume.segments[0].label;
  return lattice_of(std::move(volume), 100, poisson, {0, offset});
}

Condition patch(const std::string& name, const Vec3& center, double radius, const Vec3& by, SurfacePoints on) {
  Condition c;
  c.name = c.where = name;
  c.selection.balls = {{center, radius}};
  c.selection.on = on;
  c.by = by;
  return c;
}

Condition beyond(const std::string& name, const Vec3& point, const Vec3& normal, const Vec3& by, SurfacePoints on) {
  Condition c;
  c.name = c.where = name;
  c.selection.halfspace = hexsolver::HalfSpace{point, normal};
  c.selection.on = on;
  c.by = by;
  return c;
}

std::vector<Condition> pressed_ends(double half, double press, SurfacePoints on) {
  return {beyond("below", {0, 0, -half}, {0, 0, -1}, {0, 0, press / 2}, on),
          beyond("above", {0, 0, half}, {0, 0, 1}, {0, 0, -press / 2}, on)};
}

std::vector<Condition> phantom_patches(double radius) {
  return {patch("right end", {-99, -1, -15}, radius, Vec3::Zero()), patch("back", {-48, 48, -15}, radius, Vec3::Zero()),
          patch("lower end", {-50, -13, -50}, radius, Vec3::Zero()),
          patch("left end", {99, -19, 7}, radius, {0, -28.284271, -28.284271})};
}

std::vector<Vec3> circle(double radius) {
  constexpr int count = 360;
  std::vector<Vec3> out;
  for (int n = 0; n < count; ++n) {
    const double angle = n * 2 * std::numbers::pi / count;
    out.emplace_back(radius * std::cos(angle), radius * std::sin(angle), 0);
  }
  return out;
}

std::vector<Vec3> material_points(const Lattice& lattice) {
  std::vector<Vec3> out;
  for (const hexmesh::Index3& v : lattice.levels.front().cells)
    out.push_back(lattice.voxels.position(Vec3(v[0], v[1], v[2])));
  return out;
}

std::vector<Vec3> displacement_at(const hexmesh::Result& result, const std::vector<Vec3>& places) {
  const hexmesh::CellLocator locator = hexmesh::locator_of(result);
  std::vector<Vec3> u;
  hexmesh::EmbeddedPoints(locator, result.cell_nodes, places)
      .interpolate({result.displacement.front().data(), 3 * result.displacement.size()}, u);
  return u;
}

}  // namespace hextools
