// SPDX-License-Identifier: Apache-2.0
// What a solution says about its own error, against the lattice's finest level; and solutions against independent ones
// of other meshes.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "hexbench/level_errors.h"
#include "hexmesh/scan/phantom.h"
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

// The smooth shape of the same liver, meshed by quadratic tetrahedra and solved by CalculiX: the staircase and the
// outline of the patches alone make about 0.2 mm.
TEST(SmoothLiver, IsMetByVoxelsAndByCellsOfEight) {
  if (!has_scan()) GTEST_SKIP() << "no shared data beside the project";
  for (const double poisson : {0.3, 0.4}) {
    const Lattice lattice = liver_of_scan(poisson);
    const std::vector<NodeRow> reference = within(
        lattice, read_reference(shared_data() / "reference" / fmt::format("liver_{}_linear_tetA_r20.csv.gz", poisson)));
    ASSERT_GT(reference.size(), 5000U);
    for (const auto& [level, allowed] : {std::pair{1, 0.8}, std::pair{0, 0.4}}) {
      const Solved s = solve(lattice, with(liver_patches(20, SurfacePoints::faces)), level);
      const Distance d = distance(s.result, reference);
      std::printf("nu %g, level %d: mean %.3f, largest %.3f mm at %zu points\n", poisson, level, d.mean, d.largest,
                  reference.size());
      EXPECT_LT(d.mean, allowed);
    }
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

TEST(AutomaticStrain, TurnsCellsWhereThatChangesMoreThanTheAccuracy) {
  const Lattice lattice = liver_of_phantom(3, 0.3);
  for (const auto& [pull, turns] : {std::pair{2.0, false}, std::pair{40.0, true}}) {
    Scene scene = with(phantom_patches(12), Elasticity::corotational);
    scene.conditions.back().by *= pull / 40;
    scene.finds_strain = true;
    scene.accuracy = 0.4;
    const Solved found = solve(lattice, scene, 0);
    scene.finds_strain = false;
    scene.accuracy.reset();
    const Solved turning = solve(lattice, scene, found.report.levels.back().level);
    EXPECT_EQ(found.report.elasticity, turns ? Elasticity::corotational : Elasticity::cauchy) << pull;
    const std::vector<Vec3> points = material_points(lattice);
    const Distance d = distance(displacement_at(found.result, points), displacement_at(turning.result, points));
    scene.finds_strain = true;  // at a given level likewise, compared with 1 % of the displacement
    scene.conditions.back().by *= turns ? 1 : 0.1;
    const Solved given = solve(lattice, scene, 1);
    EXPECT_EQ(given.report.elasticity, turns ? Elasticity::corotational : Elasticity::cauchy);
    EXPECT_EQ(given.report.levels.back().newton.iterations == 1, !turns);  // a linear level takes one step
    std::printf("pulled by %g mm: %s, off by %.4f mm on average\n", pull, turns ? "rotations on" : "rotations off",
                d.mean);
    EXPECT_LT(d.mean, 0.4);
    const auto rotation = std::find_if(found.report.effects.begin(), found.report.effects.end(),
                                       [](const Effect& e) { return e.name == "rotation"; });
    std::printf("  %s\n", rotation->why.c_str());
    EXPECT_EQ(rotation->why.find("cells rotate") != std::string::npos, turns);
  }
}

TEST(AutomaticStrain, ARigidMotionOfTheWholeMakesNoDifference) {
  // A rod, held at one end and pushed aside at the other, by little and by much.
  const Lattice lattice = lattice_of(solid("cylinder", 4, {{"radius", 10}, {"height", 200}}), 100, 0.3);
  const auto found = [&](double aside, const Vec3& shift) {
    Scene scene = with(pressed_ends(100, 0, SurfacePoints::nodes), Elasticity::corotational);
    scene.finds_strain = true;
    for (Condition& c : scene.conditions) c.by = shift;
    scene.conditions.back().by += Vec3(aside, 0, 0);
    return solve(lattice, scene, 0);
  };
  for (const double aside : {0.5, 80.0}) {
    const Solved alone = found(aside, Vec3::Zero());
    EXPECT_EQ(alone.report.elasticity, aside > 1 ? Elasticity::corotational : Elasticity::cauchy);
    for (const Vec3& shift : {Vec3(1000, 0, 0), Vec3(-300, 2000, 5000)}) {
      const Solved shifted = found(aside, shift);
      EXPECT_EQ(shifted.report.elasticity, alone.report.elasticity);
      double largest = 0;
      for (std::size_t n = 0; n < alone.result.displacement.size(); ++n)
        largest = std::max(largest, (shifted.result.displacement[n] - shift - alone.result.displacement[n]).norm());
      EXPECT_LT(largest, 1e-3 * aside) << shift.transpose();
    }
  }
}

}  // namespace test_accuracy
