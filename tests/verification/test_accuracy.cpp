// SPDX-License-Identifier: Apache-2.0
// What a solution says about its own error, against the lattice's finest level; and solutions against independent ones
// of other meshes.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "hexbench/level_errors.h"
#include "hexmesh/scan/phantom.h"
#include "support/bodies.h"
#include "support/experiments.h"
#include "support/files.h"
#include "support/limits.h"

namespace test_accuracy {

using namespace hexsolver;
using namespace testing_support;

struct Experiment {
  const char* name;
  std::function<Lattice()> lattice;
  std::function<Scene()> scene;
};

void PrintTo(const Experiment& e, std::ostream* out) { *out << e.name; }

Scene under_gravity(std::vector<Condition> conditions, const Vec3& gravity,
                    Elasticity elasticity = Elasticity::cauchy) {
  Scene scene = with(std::move(conditions), elasticity);
  scene.gravity = gravity;
  return scene;
}

hexmesh::LabelVolume turned_beam() {
  hexmesh::SolidPhantom beam;
  beam.spacing = 2.5;
  beam.rotation = {0, 20, 0};
  return hexmesh::solid_phantom(beam);
}

const std::vector<Experiment>& experiments() {
  static const std::vector<Experiment> all = {
      {"phantom liver, linear", [] { return liver_of_phantom(3, 0.3); }, [] { return with(phantom_patches(12)); }},
      {"phantom liver, smaller cells and patches", [] { return liver_of_phantom(2, 0.3); },
       [] { return with(phantom_patches(8)); }},
      {"phantom liver, nu 0.45", [] { return liver_of_phantom(3, 0.45); }, [] { return with(phantom_patches(12)); }},
      {"phantom liver, co-rotational", [] { return liver_of_phantom(3, 0.3); },
       [] { return with(phantom_patches(12), Elasticity::corotational); }},
      {"beam bent by a patch", [] { return lattice_of(solid("beam", 2, {}), 100, 0.3); },
       [] {
         return with(
             {beyond("end", {-79.9, 0, 0}, {-1, 0, 0}, Vec3::Zero()), patch("tip", {80, 0, 0}, 12, {0, 0, -20})});
       }},
      {"cylinder pressed by two patches",
       [] {
         return lattice_of(solid("cylinder", 2.5, {{"radius", 50}, {"height", 80}}), 100, 0.3);
       },
       [] {
         return with({patch("below", {0, 0, -40}, 20, Vec3::Zero()), patch("above", {0, 0, 40}, 20, {0, 0, -10})});
       }},
      {"beam under gravity", [] { return lattice_of(solid("beam", 2.5, {}), 100, 0.45); },
       [] {
         return under_gravity({beyond("end", {-79, 0, 0}, {-1, 0, 0}, Vec3::Zero())}, {0, 0, -3000});
       }},
      {"turned beam under gravity, co-rotational", [] { return lattice_of(turned_beam(), 100, 0.3); },
       [] {
         return under_gravity({beyond("end", {-70, 0, 0}, {-1, 0, 0}, Vec3::Zero())}, {900, 0, -3000},
                              Elasticity::corotational);
       }},
      {"phantom liver under gravity", [] { return liver_of_phantom(3, 0.45); },
       [] {
         return under_gravity({beyond("end", {-60, 0, 0}, {-1, 0, 0}, Vec3::Zero())}, {0, 0, -9810});
       }},
      {"cylinder under pressure, neo-Hookean",
       [] {
         return lattice_of(solid("cylinder", 3, {{"radius", 40}, {"height", 90}}), 20, 0.49);
       },
       [] {
         Scene scene = with({beyond("below", {0, 0, -44.9}, {0, 0, -1}, Vec3::Zero())}, Elasticity::neo_hookean);
         Force f;
         f.name = f.where = "above";
         f.selection.halfspace = HalfSpace{{0, 0, 44}, {0, 0, 1}};
         f.pressure = 0.001;
         scene.forces = {f};
         return scene;
       }},
      {"sphere pressed by a plate",
       [] {
         return lattice_of(solid("sphere", 2.5, {{"radius", 40}}), 10, 0.4);
       },
       [] {
         Scene scene = with({beyond("below", {0, 0, -25}, {0, 0, -1}, Vec3::Zero())});
         Contact plate;
         plate.name = plate.where = "plate";
         plate.obstacle = HalfSpace{{0, 0, 41}, {0, 0, -1}};
         plate.by = {0, 0, -5};
         plate.stiffness = 0.05;
         scene.contacts = {plate};
         return scene;
       }},
  };
  return all;
}

void expect_estimates(const char* name, const Lattice& lattice, Scene scene) {
  scene.error_estimation = ErrorEstimation::look;
  const hextools::LevelErrorMeter meter(lattice, scene);
  std::printf("%s\n  level    cells   estimated, true mean error [mm]   estimated, true largest\n", name);
  const int coarsest = hextools::coarsest_level(lattice, 64);
  for (int level = coarsest; level >= 1; --level) {
    const hextools::LevelErrors errors = meter.of_level(level);
    EXPECT_TRUE(errors.converged);
    const std::optional<double>& mean = errors.mean.estimate;
    std::printf("  %5d %8zu   %8.3f %8.3f                %8.3f %8.3f\n", level, errors.cells, mean.value_or(NAN),
                errors.mean.error, errors.largest.estimate.value_or(NAN), errors.largest.error);
    // Unknown is an answer where levels do not come closer; the one before the finest has seen all there is.
    EXPECT_TRUE(mean || level > 1);
    if (!mean) continue;
    const double factor = level == coarsest ? 3 : 2;
    EXPECT_LT(*mean, factor * errors.mean.error) << "level " << level;
    EXPECT_GT(*mean, errors.mean.error / factor) << "level " << level;
  }
}

class Estimate : public testing::TestWithParam<Experiment> {};

TEST_P(Estimate, IsTheErrorWithinAFactorOfTwo) {
  expect_estimates(GetParam().name, GetParam().lattice(), GetParam().scene());
}

INSTANTIATE_TEST_SUITE_P(All, Estimate, testing::ValuesIn(experiments()));

TEST(EstimateOfARealLiver, IsTheErrorWithinAFactorOfTwo) {
  if (!has_scan()) GTEST_SKIP() << "no shared data beside the project";
  const Lattice lattice = liver_of_scan(0.3);
  const auto patches = [](double radius) { return liver_patches(radius, SurfacePoints::faces); };
  expect_estimates("linear", lattice, with(patches(10)));
  expect_estimates("larger patches", lattice, with(patches(20)));
  expect_estimates("co-rotational", lattice, with(patches(10), Elasticity::corotational));
}

TEST(EstimateOfASmallBody, IsItsErrorForLevelZeroIsLookedAt) {
  // Two blocks that meet in a hinge of two by two voxels, which no coarser level shows.
  const auto blocks = [](const Index3& v) -> std::uint16_t {
    return (v[0] < 20 && v[1] < 12) || (v[0] >= 18 && v[1] >= 10) ? 1 : 0;
  };
  const Lattice lattice = lattice_of(make_volume({38, 22, 12}, {2, 2, 2}, blocks), 100, 0.3);
  Scene scene = with({beyond("end", {1, 0, 0}, {-1, 0, 0}, Vec3::Zero()), patch("tip", {74, 32, 12}, 8, {2, 6, 0})});
  scene.error_estimation = ErrorEstimation::automatic;
  const hextools::LevelErrorMeter meter(lattice, scene);
  for (const int level : {2, 1}) {
    const hextools::LevelErrors errors = meter.of_level(level);
    constexpr double of_a_look = 0.05;  // which is solved roughly
    EXPECT_NEAR(errors.mean.estimate.value_or(0), errors.mean.error, of_a_look * errors.mean.error);
    for (const hextools::Estimated& r : errors.reactions)
      EXPECT_NEAR(r.estimate.value_or(0), r.error, of_a_look * r.error);
  }
}

class HangingBeam : public testing::TestWithParam<double> {};

TEST_P(HangingBeam, BendsAsQuadraticElementsSay) {
  // 160 x 40 x 40 mm, E = 100 kPa, 1000 kg/m^3, one end clamped, 9.81 m/s^2 across it; the middle of the free end.
  const double poisson = GetParam();
  const double expected = limit_of(fmt::format("beam, cauchy, E 100, nu {}", poisson), "tip_z_mm");
  const Lattice lattice = lattice_of(solid("beam", 2, {}), 100, poisson);
  Scene scene = with({beyond("clamp", {-80, 0, 0}, {-1, 0, 0}, Vec3::Zero(), SurfacePoints::nodes)});
  scene.gravity = {0, 0, -9810};
  double before = 1;
  for (int level = 2; level >= 0; --level) {
    const Solved s = solve(lattice, scene, level);
    const double tip = displacement_at(s.result, {{79.999, 0, 0}})[0][2];
    const double error = std::abs(tip / expected - 1);
    std::printf("nu %g, level %d: tip %.3f mm, off by %.2f %%\n", poisson, level, tip, 100 * error);
    EXPECT_LT(error, level == 0 ? 0.003 : before);
    EXPECT_LT(error, before);
    before = error;
  }
}

INSTANTIATE_TEST_SUITE_P(Poisson, HangingBeam, testing::Values(0.3, 0.45));

TEST(PressedCylinder, BulgesAsAxisymmetricElementsSay) {
  // Height 100 mm, radius 50 mm, nu = 0.49, ends clamped and pressed together by 10 %: how much the radius grows.
  const double expected = limit_of("cylinder, cauchy, height 100, 10 %", "growth_mm");
  const Lattice lattice = lattice_of(solid("cylinder", 2, {{"radius", 50}, {"height", 100}}), 100, 0.49);
  const Scene scene = with(pressed_ends(50, 10, SurfacePoints::nodes));
  double before = 1;
  for (int level = 2; level >= 0; --level) {
    const Solved s = solve(lattice, scene, level);
    const double growth = growth_half_way(s.result, 50);
    const double error = std::abs(growth / expected - 1);
    std::printf("level %d: radius grows by %.4f mm, off by %.2f %%\n", level, growth, 100 * error);
    EXPECT_LT(error, level == 0 ? 0.005 : before);
    EXPECT_LT(error, before);
    before = error;
  }
}

}  // namespace test_accuracy
