// SPDX-License-Identifier: Apache-2.0
// Two bodies that meet in a point, both of voxels, against quadratic elements of the smooth bodies and Hertz's theory.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "support/bodies.h"
#include "support/experiments.h"
#include "support/limits.h"

namespace test_punch {

using namespace hexsolver;
using namespace testing_support;

constexpr double voxel = 0.5, end_radius = 20, apart = 2;               // mm
constexpr double young_below = 20, young_above = 10;                    // kPa
constexpr double poisson_below = 0.3, poisson_above = 0.45;             // 1
constexpr double floor_mm = 29.75, bottom = 0.25, top = floor_mm + 22;  // of the surfaces, along z [mm]

/// A punch with a round end above a cylinder, 2 mm apart: that of "punch" in tests/data/make_limits.py.
Lattice punch_and_base() {
  const hexmesh::LabelVolume volume = make_volume({120, 120, 104}, Vec3::Constant(voxel), [](const Index3& v) {
    const double x = voxel * (v[0] - 59.5), y = voxel * (v[1] - 59.5), z = voxel * v[2] - floor_mm, r2 = x * x + y * y;
    if (z < 0) return r2 < 30 * 30 ? 1 : 0;
    const double rise = end_radius - std::sqrt(std::max(end_radius * end_radius - r2, 0.0));
    return r2 < 12 * 12 && z - apart > rise ? 2 : 0;
  });
  std::vector<hexmesh::LatticeSegment> segments = {
      {{1, "base"}, hexmesh::material_from_units(young_below, poisson_below, 1000), 0, ""},
      {{2, "punch"}, hexmesh::material_from_units(young_above, poisson_above, 1000), 0, ""}};
  hexmesh::LatticeOptions options{3, {0, 0, 0}, {}};
  options.parting.sliding = {{1, 2}};
  return build_lattice(volume, segments, options);
}

Scene moved_down(double depth, const std::pair<std::string, std::string>& between) {
  Scene scene = with({beyond("below", {0, 0, bottom}, {0, 0, -1}, Vec3::Zero()),
                      beyond("above", {0, 0, top - 0.5}, {0, 0, 1}, {0, 0, -(apart + depth)})});
  scene.volumetric = Volumetric::full;
  scene.grading = Grading::off;
  Contact contact;
  contact.name = "tip";
  contact.between = between;
  scene.contacts = {contact};
  return scene;
}

/// Hertz's pressure in the middle under a force [MPa].
double middle_pressure(double force) {
  const auto plane = [](double young_kpa, double poisson) { return (1 - poisson * poisson) / (1e-3 * young_kpa); };
  const double both = 1 / (plane(young_below, poisson_below) + plane(young_above, poisson_above));
  const double radius = std::cbrt(3 * force * end_radius / (4 * both));
  return 3 * force / (2 * std::numbers::pi * radius * radius);
}

TEST(Punch, MeetsACylinderAsQuadraticElementsAndHertzSay) {
  // Cells of 2 mm are a quarter of the contact's width. Pressure in the middle of these bodies is 2 to 3 % above
  // Hertz's, which is of half-spaces.
  const Lattice lattice = punch_and_base();
  using Names = std::pair<std::string, std::string>;
  const Names flat_first = {"base", "punch"}, round_first = {"punch", "base"};
  struct Case {
    int level;
    Names between;
    double force, pressure;  // within
  };
  for (const Case& within : {Case{1, flat_first, 0.02, 0.08}, Case{1, round_first, 0.02, 0.08},
                             Case{2, flat_first, 0.08, 0.08}, Case{2, round_first, 0.08, 0.08}})
    for (const double depth : {1.0, 2.0}) {
      const Solved s = solve(lattice, moved_down(depth, within.between), within.level);
      const double force = std::abs(s.report.conditions[1].reaction_n[2]);
      const double expected = limit_of(fmt::format("punch, cauchy, depth {:g}", depth), "force_n");
      const std::vector<double>& pressures = s.result.cell_fields.at("contact_pressure");
      const double highest = *std::max_element(pressures.begin(), pressures.end());
      const double off = force / expected - 1, pressure_off = highest / middle_pressure(force) - 1;
      std::printf(
          "cells of %g mm, %s first, depth %g mm: force %.4f N, off by %+.1f %%; pressure %.3f kPa, off by %+.1f %%\n",
          voxel * (1 << within.level), within.between.first.c_str(), depth, force, 100 * off, 1e3 * highest,
          100 * pressure_off);
      EXPECT_LT(std::abs(off), within.force);
      EXPECT_LT(std::abs(pressure_off), within.pressure);
    }
}

}  // namespace test_punch
