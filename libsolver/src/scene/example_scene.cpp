// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "hexmesh/core/error.h"
#include "hexmesh/core/partition.h"
#include "hexsolver/scene/scene.h"

namespace hexsolver {

using hexmesh::as_size;
using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Lattice;

namespace {

/// The largest part of the voxels that are joined through faces.
struct LargestPart {
  std::vector<hexmesh::ExposedFace> faces;  ///< exposed ones
  double thickness = 0;                     ///< of a ball with as much volume for its surface [mm]
  std::ptrdiff_t others = 0;                ///< number of other parts
};

LargestPart largest_part(const Lattice& lattice) {
  LargestPart part{hexmesh::exposed_faces(lattice)};
  const std::vector<hexmesh::VoxelClass> classes = hexmesh::classify_voxels(lattice);
  const auto is_material = [&](std::size_t n) { return classes[n] != hexmesh::VoxelClass::outside; };
  hexmesh::Partition parts(classes.size());
  std::vector<std::size_t> size(classes.size());
  for (std::size_t n = 0; n < classes.size(); ++n)
    for (std::size_t d = 0; d < 3 && is_material(n); ++d) {
      hexmesh::Index3 lower = lattice.voxels.index(n);
      if (--lower[d] < 0) continue;
      if (const std::size_t m = lattice.voxels.offset(lower); is_material(m))
        parts.join(static_cast<std::int32_t>(n), static_cast<std::int32_t>(m));
    }
  for (std::size_t n = 0; n < classes.size(); ++n)
    if (is_material(n)) ++size[parts.root(static_cast<std::int32_t>(n))];
  part.others = std::count_if(size.begin(), size.end(), [](std::size_t n) { return n > 0; }) - 1;
  const auto largest = static_cast<std::int32_t>(std::max_element(size.begin(), size.end()) - size.begin());
  std::erase_if(part.faces, [&](const hexmesh::ExposedFace& f) {
    return parts.root(static_cast<std::int32_t>(lattice.voxels.offset(f.voxel))) != largest;
  });
  const Vec3 spacing = lattice.voxels.spacing();
  double area = 0;
  for (const hexmesh::ExposedFace& f : part.faces) area += spacing.prod() / spacing[f.side / 2];
  part.thickness = 6 * static_cast<double>(size[as_size(largest)]) * spacing.prod() / area;
  return part;
}

/// A number that people like, 1, 1.5, 2, 3, 5 or 7 times a power of ten, at most `most`.
double round_down(double most) {
  const double power = std::pow(10, std::floor(std::log10(most)));
  double round = power;
  for (const double digit : {1.5, 2.0, 3.0, 5.0, 7.0})
    if (digit * power <= most) round = digit * power;
  return round;
}

}  // namespace

std::string example_scene(const Lattice& lattice) {
  // The paper's 40 mm, and patches of 10 mm, are for a liver: thin and small bodies bear less.
  constexpr double as_a_liver = 50, part_pulled = 0.4, part_held = 0.2;  // of the thickness
  const auto [faces, thickness, others] = largest_part(lattice);
  const double pull = thickness >= as_a_liver ? 40 : round_down(thickness * part_pulled);
  const double radius = thickness >= as_a_liver ? 10 : round_down(thickness * part_held);
  // Extreme points of the surface, each at least three patch radii from those chosen before.
  struct Place {
    const char* name;
    Vec3 towards;
  };
  const std::array<Place, 8> places = {{{"left end", {1, 0, 0}},
                                        {"right end", {-1, 0, 0}},
                                        {"back", {0, 1, 0}},
                                        {"lower end", {0, 0, -1}},
                                        {"upper end", {0, 0, 1}},
                                        {"front", {0, -1, 0}},
                                        {"lower right", {-1, 0, -1}},
                                        {"upper right", {-1, 0, 1}}}};
  std::vector<std::pair<std::string, Vec3>> chosen;
  for (const Place& place : places) {
    const auto position = [&](const hexmesh::ExposedFace& f) {
      return lattice.voxels.position(hexmesh::face_index(f));
    };
    const auto room = [&](const Vec3& point) {  // to those chosen
      double least = std::numeric_limits<double>::infinity();
      for (const auto& c : chosen) least = std::min(least, (c.second - point).norm());
      return least;
    };
    double most = -std::numeric_limits<double>::infinity();
    for (const hexmesh::ExposedFace& f : faces) most = std::max(most, position(f).dot(place.towards));
    std::vector<Vec3> farthest;  // flat ends have many
    for (const hexmesh::ExposedFace& f : faces)
      if (const Vec3 point = position(f); point.dot(place.towards) >= most - 1e-9) farthest.push_back(point);
    Vec3 point = farthest.front();
    if (room(point) <= 3 * radius)
      point = *std::max_element(farthest.begin(), farthest.end(),
                                [&](const Vec3& p, const Vec3& q) { return room(p) < room(q); });
    if (room(point) > 3 * radius && chosen.size() < 4) chosen.emplace_back(place.name, point);
  }
  if (chosen.size() < 4)
    throw Error(ErrorKind::geometry, fmt::format("the body has no four places for patches of {:g} mm", radius));

  const double finest = lattice.voxels.spacing().minCoeff();
  const int decimals = std::max(3, 2 - static_cast<int>(std::floor(std::log10(finest))));
  std::string text = fmt::format(
      "# Three places on the surface held, a fourth pulled by {:g} mm: the displacement-driven liver experiment of\n"
      "# Nesme, Faure, Payan, \"Accurate interactive animation of deformable models at arbitrary resolution\" (2010).\n"
      "# Positions are patient LPS in mm. radius_mm = 0 takes the one nearest point, as in the paper.\n"
      "[solve]\nkind = \"equilibrium\"\nstrain = \"corotational\"   # or \"cauchy\", \"green-lagrange\", \"auto\"; or "
      "law = \"neo-hookean\"\n"
      "volumetric = \"mean\"        # or \"full\", the paper's\ntolerance = \"auto\"         # as its cells deserve; "
      "or a residual, e.g. 1e-8\n",
      pull);
  if (others > 0)
    text += fmt::format("islands = \"drop\"           # of the {} smaller parts those that nothing holds\n", others);
  for (std::size_t n = 1; n < 4; ++n)
    text += fmt::format("\n[[fix]]\nname = \"{}\"\npoint_mm = [{:.{}f}, {:.{}f}, {:.{}f}]\nradius_mm = {:g}\n",
                        chosen[n].first, chosen[n].second[0], decimals, chosen[n].second[1], decimals,
                        chosen[n].second[2], decimals, radius);
  text += fmt::format(
      "\n[[displace]]\nname = \"{}\"\npoint_mm = [{:.{}f}, {:.{}f}, {:.{}f}]\nradius_mm = {:g}\n"
      "by_mm = [0.0, {:.8g}, {:.8g}]   # {:g} mm to the front and down\n",
      chosen[0].first, chosen[0].second[0], decimals, chosen[0].second[1], decimals, chosen[0].second[2], decimals,
      radius, -pull * std::sqrt(0.5), -pull * std::sqrt(0.5), pull);
  return text;
}

}  // namespace hexsolver
