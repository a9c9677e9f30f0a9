// SPDX-License-Identifier: Apache-2.0
// strain = "auto": cells rotate where that matters, and only there.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "equilibrium/choose_strain.h"
#include "support/bodies.h"
#include "support/experiments.h"
#include "support/forms.h"

namespace test_automatic_strain {

using namespace hexsolver;
using namespace testing_support;

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

/// An accuracy of 0.2 mm takes rotating cells, alike and graded, and is kept.
void expect_rotations(const Lattice& lattice, Scene scene) {
  const std::vector<Vec3> points = material_points(lattice);
  const auto truth = displacement_at(solve(lattice, scene, 0).result, points);
  scene.finds_strain = true;
  scene.accuracy = 0.2;
  for (const Grading grading : {Grading::off, Grading::scene}) {
    scene.grading = grading;
    const Solved found = solve(lattice, scene, 0);
    EXPECT_EQ(found.report.elasticity, Elasticity::corotational);
    EXPECT_LT(distance(displacement_at(found.result, points), truth).mean, 1.2 * *scene.accuracy);
  }
}

TEST(AutomaticStrain, ComparesAgainWhereACoarseLevelWasTooStiff) {
  // A curved sheet of one or two voxels that hangs on an edge turns over, which the cells of level 3 do not show.
  const auto sheet = [](const Index3& v) -> std::uint16_t {
    const double height = 8 + 5 * std::sin(v[0] * std::numbers::pi / 20) * std::cos(v[1] * std::numbers::pi / 40);
    return std::abs(v[2] - height) < 1.4 ? 1 : 0;
  };
  Scene scene = with({beyond("edge", {5.4, 0, 0}, {-1, 0, 0}, Vec3::Zero())}, Elasticity::corotational);
  scene.gravity = {0, 0, -1000};
  expect_rotations(lattice_of(make_volume({40, 40, 16}, {2, 2, 2}, sheet), 100, 0), scene);
}

TEST(AutomaticStrain, ComparesOnTheLevelThatAnAccuracyEndsOn) {
  // A block that is stretched, with a thin tab that turns: the cells of level 2 show half of that, and the mean
  // deformation is the block's.
  const auto block_with_tab = [](const Index3& v) -> std::uint16_t {
    const bool in_block = v[0] < 16, in_tab = v[1] >= 4 && v[1] < 12 && v[2] >= 22 && v[2] < 24;
    return in_block || in_tab ? 1 : 0;
  };
  Scene scene =
      with({beyond("bottom", {0, 0, 1.5}, {0, 0, -1}, Vec3::Zero()), beyond("top", {0, 0, 48.5}, {0, 0, 1}, {4, 0, 3})},
           Elasticity::corotational);
  Force tip;
  tip.name = tip.where = "tip";
  tip.selection.balls = {{{86, 15, 45}, 12}};
  tip.total = {0, 0, -0.002};
  scene.forces = {tip};
  expect_rotations(lattice_of(make_volume({44, 16, 26}, {2, 2, 2}, block_with_tab), 100, 0.3), scene);
}

struct Body {
  const char* name;
  std::function<Lattice()> lattice;
  Vec3 low, high;  ///< places at both ends of its long axis
  double across;   ///< [mm]
  int level;
};

/// The five ways to load a body whose end `low` is held; bends by a twelfth of the length where the part is 1.
Scene loaded(const Body& body, int way, double part) {
  const double length = (body.high - body.low).norm(), young = 0.1;  // N/mm^2
  const Vec3 axis = (body.high - body.low) / length, side = axis.unitOrthogonal();
  Scene scene = with({beyond("end", body.low + 0.06 * length * axis, -axis, Vec3::Zero())}, Elasticity::corotational);
  const double bend = part * young * std::pow(body.across, 2) / std::pow(length, 3) / 18 * 1e9;  // mm/s^2, 1000 kg/m^3
  const auto force = [&](const Vec3& total, double pressure) {
    Force f;
    f.name = f.where = "force";
    f.selection.balls = {{body.high, 0.4 * body.across}};
    f.selection.max_distance = length;
    f.total = total;
    if (pressure != 0) f.pressure = pressure;
    scene.forces = {f};
  };
  switch (way) {
    case 0:
      scene.conditions.push_back(patch("tip", body.high, 0.3 * body.across, part * 0.1 * length * side));
      break;
    case 1:
      scene.gravity = -bend * side;
      break;
    case 2:
      scene.gravity = 0.7 * bend * (axis - 0.5 * side);
      break;
    case 3:
      // Half of what buckles it at most: a straight body that buckles does not turn before.
      force(Vec3::Zero(),
            std::min(0.01, 0.5 * std::pow(std::numbers::pi * body.across / length, 2) / 48) * part * young);
      break;
    default:
      force(-part * young * std::pow(body.across, 4) / std::pow(length, 2) / 48 * side, 0);
  }
  return scene;
}

TEST(AutomaticStrain, LooksAtFewCellsFirstAndAtNoMoreThanTwoLevelsUp) {
  const std::vector<std::size_t> cells = {1'000'000, 125'000, 16'000, 2'000, 260, 35, 6};
  const auto levels = [&](int asked) {
    const StrainLevels l = levels_to_compare_strains(cells, 6, asked);
    return std::pair{l.coarsest, l.finest};
  };
  EXPECT_EQ(levels(0), (std::pair{3, 3}));  // at most 2,000 cells
  EXPECT_EQ(levels(1), (std::pair{4, 3}));  // a 200th: 625
  EXPECT_EQ(levels(2), (std::pair{5, 4}));  // 80
  EXPECT_EQ(levels(3), (std::pair{5, 5}));  // at least 30 cells
  EXPECT_EQ(levels(5), (std::pair{5, 5}));  // what is coarser has fewer
  EXPECT_EQ(levels(6), (std::pair{6, 6}));
  const std::vector<double> margins = {strain_margin(0), strain_margin(1), strain_margin(2), strain_margin(3),
                                       strain_margin(4)};
  EXPECT_EQ(margins, (std::vector<double>{1, 2, 2, 4, 8}));
}

TEST(AutomaticStrain, KeepsItsAccuracyWhateverTheBodyAndTheLoad) {
  const auto bar = [](double width, double height, double spacing) {
    return [=] { return lattice_of(solid("beam", spacing, {{"width", width}, {"height", height}}), 100, 0.4); };
  };
  const std::vector<Body> bodies = {
      {"beam", bar(40, 40, 4), {-80, 0, 0}, {80, 0, 0}, 40, 1},
      {"slender beam", bar(16, 16, 2), {-80, 0, 0}, {80, 0, 0}, 16, 0},
      {"sheet", bar(60, 6, 2), {-80, 0, 0}, {80, 0, 0}, 6, 0},
      {"ball",
       [] {
         return lattice_of(solid("sphere", 4, {{"radius", 40}}), 100, 0.4);
       },
       {0, 0, -40},
       {0, 0, 40},
       70,
       1},
      {"liver", [] { return liver_of_phantom(4, 0.4); }, {-99, -1, -15}, {99, -19, 7}, 60, 0}};
  int scenes = 0, rotating = 0;
  double worst = 0;
  for (const Body& body : bodies) {
    const Lattice lattice = body.lattice();
    const std::vector<Vec3> points = material_points(lattice);
    for (int way = 0; way < 5; ++way)
      for (const double part : {1.0, 0.1, 0.01}) {
        if (part == 0.1 && !is_full()) continue;
        SCOPED_TRACE(fmt::format("{}, load {}, part {}", body.name, way, part));
        Scene scene = loaded(body, way, part);
        const std::vector<Vec3> turning = displacement_at(solve(lattice, scene, body.level).result, points);
        scene.finds_strain = true;
        const Solved found = solve(lattice, scene, body.level);
        double mean = 0;
        for (const Vec3& u : turning) mean += u.norm() / static_cast<double>(turning.size());
        const double off = distance(displacement_at(found.result, points), turning).mean / mean;
        EXPECT_LT(off, 0.01);  // of the mean displacement, where no accuracy is asked
        worst = std::max(worst, off);
        ++scenes;
        rotating += found.report.elasticity == Elasticity::corotational;
      }
  }
  std::printf("%d scenes, %d of them rotate, off by %.2f %% of the mean displacement at most\n", scenes, rotating,
              100 * worst);
  EXPECT_GT(rotating, scenes / 4);  // neither rule is all
  EXPECT_LT(rotating, scenes * 3 / 4);
}

}  // namespace test_automatic_strain
