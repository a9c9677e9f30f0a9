// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "hexsolver/scene/scene.h"
#include "hexsolver/scene/scene_files.h"
#include "support/files.h"

namespace test_scene {

using namespace hexsolver;
using namespace testing_support;
using hexmesh::ErrorKind;

constexpr const char* good = R"([solve]
strain = "cauchy"
level = 2
[material.liver]
young_kpa = 3
[[fix]]
name = "hilum"
point_mm = [-80.1, 45.0, 120]
radius_mm = 12
axes = "xz"
[[fix]]
halfspace = { point_mm = [0, 0, 110], normal = [0, 0, -2] }
on = "nodes"
[[displace]]
box_mm = [0, 1, 2, 4, 5, 9]
by_mm = [12, 20.5, -32]
)";

std::string error_of(const std::string& text, const std::vector<std::string>& settings = {}) {
  const TemporaryFolder folder;
  write_text(folder / "s.toml", text);
  return message_of(settings.empty() ? ErrorKind::input : ErrorKind::usage,
                    [&] { read_scene(folder / "s.toml", "s.toml", settings); });
}

Scene scene_of(const std::string& text, const std::vector<std::string>& settings = {}) {
  const TemporaryFolder folder;
  write_text(folder / "s.toml", text);
  return read_scene(folder / "s.toml", "s.toml", settings);
}

TEST(Scene, ReadsEveryTable) {
  const Scene scene = scene_of(good);
  EXPECT_EQ(scene.elasticity, Elasticity::cauchy);
  EXPECT_EQ(scene.level, 2);
  EXPECT_EQ(scene.materials.at("liver").young_kpa, 3);
  ASSERT_EQ(scene.conditions.size(), 3U);
  EXPECT_EQ(scene.conditions[0].name, "hilum");
  EXPECT_EQ(scene.conditions[0].axes, (std::array<bool, 3>{true, false, true}));
  EXPECT_EQ(scene.conditions[0].selection.balls[0].radius, 12);
  EXPECT_EQ(scene.conditions[1].selection.halfspace->normal, Vec3(0, 0, -1));
  EXPECT_EQ(scene.conditions[1].selection.on, SurfacePoints::nodes);
  EXPECT_EQ(scene.conditions[2].by, Vec3(12, 20.5, -32));
  EXPECT_EQ(scene.conditions[2].selection.box->center, Vec3(0.5, 3, 7));
}

TEST(Scene, ATypoInAKeyIsNamedWithItsPlaceAndTheKeysThatExist) {
  EXPECT_EQ(
      error_of("[solve]\nlevl = 2\n"),
      "s.toml:2:1: unknown key 'solve.levl', expected one of: kind, strain, law, rotation, volumetric, "
      "stiffness, level, accuracy_mm, accuracy_reactions, budget_s, supports, grading, coarser_by, error_estimate, "
      "tolerance, islands, conflicts, reference, inverse");
  EXPECT_EQ(error_of("[[fix]]\npoint_mm = [0, 0, 0]\n  radius = 3\n").substr(0, 34),
            "s.toml:3:3: unknown key 'fix.radiu");
}

TEST(Scene, AWrongValueIsNamedWithItsPlaceAndWhatWasExpected) {
  EXPECT_EQ(error_of("[solve]\n\nstrain = \"cauchi\"\n"),
            "s.toml:3:10: solve.strain is 'cauchi', expected \"cauchy\" or \"linear\" or \"corotational\" or "
            "\"green-lagrange\" or "
            "\"auto\"");
  EXPECT_EQ(error_of("[[fix]]\npoint_mm = [1, 2]\n"),
            "s.toml:2:12: fix.point_mm is [ 1, 2 ], expected three numbers [x, y, z], LPS, mm");
  EXPECT_EQ(error_of("[[fix]]\npoint_mm = [1, 2, nan]\n"),
            "s.toml:2:19: fix.point_mm is nan, expected three numbers [x, y, z], LPS, mm");
  EXPECT_EQ(error_of("[solve]\nlevel = -1\n"),
            "s.toml:2:9: solve.level is -1, expected a level of the lattice, 0 or more");
}

TEST(Scene, BrokenTomlIsNamedWithItsPlace) {
  EXPECT_EQ(error_of("[solve]\nlevel = = 2\n").substr(0, 10), "s.toml:2:9");
}

TEST(Scene, AConditionSelectsInExactlyOneWay) {
  EXPECT_NE(error_of("[[fix]]\nname = \"a\"\n").find("selects in 0 ways"), std::string::npos);
  EXPECT_NE(error_of("[[fix]]\npoint_mm = [0,0,0]\nbox_mm = [0,1,0,1,0,1]\n").find("selects in 2 ways"),
            std::string::npos);
  EXPECT_NE(error_of("[[displace]]\npoint_mm = [0,0,0]\n").find("by_mm"), std::string::npos);
}

TEST(Scene, SettingsOverrideTheFile) {
  const Scene scene = scene_of(
      good, {"solve.strain=corotational", "solve.level=0", "displace.0.by_mm=[1,2,3]", "material.liver.poisson=0.4"});
  EXPECT_EQ(scene.elasticity, Elasticity::corotational);
  EXPECT_EQ(scene.level, 0);
  EXPECT_EQ(scene.conditions[2].by, Vec3(1, 2, 3));
  EXPECT_EQ(scene.materials.at("liver").poisson, 0.4);
  EXPECT_NE(error_of(good, {"solve"}).find("expected key=value"), std::string::npos);
  EXPECT_NE(error_of(good, {"fix.7.name=x"}).find("--set 'fix.7.name=x'"), std::string::npos);
}

TEST(Scene, WithoutPlacesNamesWhatItIsIn) {
  const auto error = [](const std::string& text, bool has_places) {
    return message_of(ErrorKind::input, [&] { parse_scene(text, "scene", "", has_places); });
  };
  EXPECT_EQ(error("[solve]\nlevel = -1\n", true),
            "scene:2:9: solve.level is -1, expected a level of the lattice, 0 or more");
  EXPECT_EQ(error("[solve]\nlevel = -1\n", false),
            "scene: solve.level is -1, expected a level of the lattice, 0 or more");
  EXPECT_EQ(error("[[fix]]\npoint_mm = [0, 0, 0]\nradius = 3\n", false).substr(0, 31),
            "scene: unknown key 'fix.radius'");
  EXPECT_EQ(error("[[force]]\nname = 'a'\nbox_mm = [0, 1, 2, 3, 'x', 4]\n", false).substr(0, 16), "scene: force.box");
  const Scene scene = parse_scene(good, "scene", "", false);
  EXPECT_EQ(scene.conditions[2].by, scene_of(good).conditions[2].by);
  EXPECT_EQ(scene.conditions[0].where, "scene");
}

TEST(Scene, ARequestGoesBeforeWhatItAsksFor) {
  Scene scene = parse_scene("[solve]\nbudget_s = 3\n", "scene", "");
  apply({}, scene);
  EXPECT_EQ(scene.budget, 3);
  apply({.accuracy = 0.5, .reaction_accuracy = 0.1}, scene);
  EXPECT_EQ(scene.accuracy, 0.5);
  EXPECT_EQ(scene.reaction_accuracy, 0.1);
  EXPECT_FALSE(scene.budget);
  apply({.level = 1, .coarser_by = 2}, scene);
  EXPECT_EQ(scene.level, 1);
  EXPECT_FALSE(scene.asks_accuracy());
  EXPECT_TRUE(scene.is_graded());
  for (const Request& wrong : {Request{.level = 1, .budget = 1}, Request{.level = -1}, Request{.level = 31},
                               Request{.accuracy = 0}, Request{.accuracy = std::nan("")}, Request{.budget = INFINITY},
                               Request{.reaction_accuracy = 2}, Request{.accuracy = 1, .budget = 1}})
    EXPECT_NE(message_of(ErrorKind::usage, [&] { apply(wrong, scene); }).find("expected"), std::string::npos);
  Scene motion = parse_scene("[solve]\nkind = 'dynamics'\n[dynamics]\nstep_s = 1\nduration_s = 1\n", "scene", "");
  apply({.level = 2}, motion);
  EXPECT_NE(message_of(ErrorKind::usage, [&] { apply({.budget = 1}, motion); }).find("the scene is a motion"),
            std::string::npos);
}

TEST(Scene, ALineMarkupIsADisplacement) {
  const TemporaryFolder folder;
  write_text(folder / "line.mrk.json",
             R"({"markups":[{"type":"Line","controlPoints":[{"position":[1,2,3]},{"position":[4,6,8]}]}]})");
  write_text(folder / "s.toml", "[[displace]]\nmarkup = \"line.mrk.json\"\n");
  const Scene scene = read_scene(folder / "s.toml", "s.toml");
  EXPECT_EQ(scene.conditions[0].by, Vec3(3, 4, 5));
  EXPECT_EQ(scene.conditions[0].selection.balls[0].center, Vec3(1, 2, 3));
}

TEST(Scene, ForcesAndGravityAreReadInTheirUnits) {
  const TemporaryFolder folder;
  write_text(
      folder / "s.toml",
      "[[force]]\npoint_mm = [0, 0, 0]\nnewton = [1, 2, 3]\n[[force]]\nname = 'probe'\n"
      "halfspace = { point_mm = [0, 0, 0], normal = [0, 0, 1] }\npressure_kpa = 4\n[gravity]\nm_s2 = [0, 9.81, 0]\n");
  const Scene scene = read_scene(folder / "s.toml", "s.toml");
  ASSERT_EQ(scene.forces.size(), 2U);
  EXPECT_EQ(scene.forces[0].name, "force 1");
  EXPECT_EQ(scene.forces[0].total, Vec3(1, 2, 3));
  EXPECT_DOUBLE_EQ(scene.forces[1].pressure, 4e-3);
  EXPECT_DOUBLE_EQ(scene.gravity[1], 9810);
  EXPECT_NE(error_of("[[force]]\npoint_mm = [0, 0, 0]\n").find("s.toml:1:1: [[force]] expects one of newton"),
            std::string::npos);
  EXPECT_NE(error_of("[[force]]\npoint_mm = [0, 0, 0]\non = 'nodes'\npressure_kpa = 1\n").find("on = \"faces\""),
            std::string::npos);
  EXPECT_NE(error_of("[gravity]\nmm_s2 = [0, 0, 1]\n").find("unknown key 'gravity.mm_s2'"), std::string::npos);
}

TEST(Scene, LawsCarryTheirOwnStrain) {
  EXPECT_EQ(scene_of("[solve]\nstrain = \"green-lagrange\"\n").elasticity, Elasticity::green_lagrange);
  EXPECT_EQ(scene_of("[solve]\nstrain = \"green-lagrange\"\n").volumetric, Volumetric::full);
  EXPECT_EQ(scene_of("[solve]\nlaw = \"neo-hookean\"\n").elasticity, Elasticity::neo_hookean);
  EXPECT_EQ(scene_of("[solve]\nlaw = \"stable-neo-hookean\"\nstrain = \"auto\"\n").elasticity,
            Elasticity::stable_neo_hookean);
  EXPECT_FALSE(scene_of("[solve]\nlaw = \"neo-hookean\"\nstrain = \"auto\"\n").finds_strain);
  EXPECT_EQ(scene_of("[solve]\nstrain = \"linear\"\n").elasticity, Elasticity::cauchy);  // another word for it
  EXPECT_EQ(error_of("[solve]\nlaw = \"neo-hookean\"\nstrain = \"cauchy\"\n"),
            "s.toml:3:10: strain goes with law = \"hooke\", expected none or \"auto\": this law has its own");
  EXPECT_EQ(error_of("[solve]\nstrain = \"green-lagrange\"\nvolumetric = \"mean\"\n"),
            "s.toml:3:14: volumetric = \"mean\" goes with other strains than \"green-lagrange\", expected \"full\"");
}

TEST(Scene, CellsRotateWhereThatMattersUnlessTheSceneSaysOtherwise) {
  for (const char* text : {"", "[solve]\nlevel = 1\n", "[solve]\nstrain = \"auto\"\n", "[solve]\nlaw = \"hooke\"\n"}) {
    const Scene scene = scene_of(text);
    EXPECT_EQ(scene.elasticity, Elasticity::corotational) << text;
    EXPECT_TRUE(scene.finds_strain) << text;
  }
  for (const char* text : {"[solve]\nstrain = \"corotational\"\n", "[solve]\nstrain = \"cauchy\"\n",
                           "[solve]\nlaw = \"neo-hookean\"\n", "[solve]\nrotation = \"edges\"\n"})
    EXPECT_FALSE(scene_of(text).finds_strain) << text;
}

TEST(Scene, AMotionHasStepsDampingAndTables) {
  const std::string dynamics = "[solve]\nkind = \"dynamics\"\n[dynamics]\nstep_s = 0.02\nduration_s = 1\n";
  const Scene scene = scene_of(dynamics + R"([damping]
mass_per_s = 2
stiffness_s = 0.01
[[displace]]
point_mm = [0, 0, 0]
table = [[0, 0, 0, 0], [0.5, 1, 2, 3]]
[[displace]]
point_mm = [0, 0, 0]
velocity_mm_s = [10, 0, 0]
[[displace]]
point_mm = [0, 0, 0]
rotate = { axis = [0, 0, 2], about_mm = [1, 0, 0] }
table = [[0, 0], [1, 180]]
[[force]]
point_mm = [0, 0, 0]
table = [[0, 0, 0, 0], [1, 0, 0, 4]]
[[force]]
point_mm = [0, 0, 0]
pressure_kpa = 2
table = [[0, 0], [1, 1]]
[[contact]]
plane = { point_mm = [0, 0, 0], normal = [0, 0, 1] }
stiffness_n_mm = 1
velocity_mm_s = [0, 0, 5]
)");
  ASSERT_TRUE(scene.dynamics);
  EXPECT_EQ(scene.dynamics->num_steps(), 50);
  EXPECT_EQ(scene.dynamics->newton_iterations, 0);
  EXPECT_EQ(scene.damping.mass_per_s, 2);
  EXPECT_EQ(prescribed_displacement(scene.conditions[0], Vec3(9, 9, 9), {0.25, 0.25}), Vec3(0.5, 1, 1.5));
  EXPECT_EQ(prescribed_displacement(scene.conditions[0], Vec3(9, 9, 9), {1, 7}), Vec3(1, 2, 3));
  EXPECT_NEAR(prescribed_displacement(scene.conditions[1], Vec3(9, 9, 9), {0.5, 0.5})[0], 5, 1e-12);
  EXPECT_LT((prescribed_displacement(scene.conditions[2], Vec3(2, 0, 4), {1, 1}) - Vec3(-2, 0, 0)).norm(), 1e-12);
  EXPECT_EQ(scene.forces[0].history->at(0.5), Vec3(0, 0, 2));
  EXPECT_EQ(scene.forces[1].history->at(0.5), Vec3(0.5, 0.5, 0.5));
  EXPECT_EQ(scene.contacts[0].history->at(1), Vec3(0, 0, 5));
  EXPECT_EQ(scene_of(dynamics + "solver_iterations = 10\n").dynamics->newton_iterations, 1);
  const Scene still = scene_of("[dynamics]\nstep_s = 0.02\nduration_s = 1\n");
  EXPECT_FALSE(still.dynamics);
  ASSERT_EQ(still.warnings.size(), 1U);
  EXPECT_EQ(still.warnings[0].find("[dynamics] has no effect"), 0U);
}

TEST(Scene, AGravityThatSmellsOfAnotherUnitIsToldOf) {
  EXPECT_TRUE(scene_of("[gravity]\nm_s2 = [0, 0, -9.81]\n").warnings.empty());
  const Scene in_mm = scene_of("[gravity]\nm_s2 = [0, 0, -9810]\n");
  ASSERT_EQ(in_mm.warnings.size(), 1U);
  EXPECT_EQ(in_mm.warnings[0], "[gravity] m_s2 is 9810 m/s^2, 1000 times the Earth's: is it meant in mm/s^2?");
}

TEST(Scene, WhatGoesWithAMotionAloneIsNamed) {
  const std::string displace = "[[displace]]\npoint_mm = [0, 0, 0]\n";
  const std::string dynamics = "[solve]\nkind = \"dynamics\"\n[dynamics]\nstep_s = 0.02\nduration_s = 1\n";
  const auto expect = [](const std::string& text, const std::string& words) {
    EXPECT_NE(error_of(text).find(words), std::string::npos) << error_of(text);
  };
  expect("[solve]\nkind = \"dynamics\"\n", "s.toml:2:8: kind is \"dynamics\", expected a table [dynamics]");
  expect("[solve]\nkind = \"dynamics\"\n[dynamics]\nstep_s = 0.1\n", "has no duration_s");
  expect(displace + "table = [[0, 0, 0, 0]]\n", "s.toml:3:9: table goes with solve.kind = \"dynamics\"");
  expect(displace + "velocity_mm_s = [0, 0, 0]\n", "velocity_mm_s goes with solve.kind = \"dynamics\"");
  expect(dynamics + displace + "table = [[0, 0, 0, 0], [0, 1, 1, 1]]\n", "table has 0 s after 0 s");
  expect(dynamics + displace + "table = [[0, 0, 0]]\n", "expected rows [[t, x, y, z], ...]");
  expect(dynamics + displace + "table = [[0, 0, 0, 0]]\nby_mm = [0, 0, 1]\n", "[[displace]] expects one of");
  expect("[solve]\nkind = \"dynamics\"\naccuracy_mm = 1\n", "accuracy_mm, accuracy_reactions and budget_s go with");
  expect(dynamics + "solver_iterations = 5\nnewton_iterations = 0\n", "newton_iterations = 0 solves to the tolerance");
  expect(dynamics + displace + "table = [[-1, 0, 0, 0]]\n", "table begins at -1 s, expected 0 or later");
  expect(dynamics + "start = \"none.hexresult\"\n", "dynamics.start is 'none.hexresult', expected a file");
  expect("[solve]\nkind = \"dynamics\"\n[dynamics]\nsteps_s = 0.1\nduration_s = 1\n", "unknown key 'dynamics.steps_s'");
  expect(dynamics + "step = 5\n", "unknown key 'dynamics.step'");
}

TEST(Scene, CondensedCellsAreOfEquilibria) {
  EXPECT_EQ(error_of("[solve]\nkind = \"dynamics\"\nstiffness = \"condensed\"\n"),
            "s.toml:3:13: stiffness = \"condensed\" goes with kind = \"equilibrium\": masses act on all that is inside "
            "cells, expected \"exact\" or \"incompatible\"");
}

TEST(Scene, AnAccuracyTakesTheCellsNearestToTheBody) {
  const auto expect_cells = [](const Scene& scene, Stiffness stiffness, Supports supports) {
    EXPECT_EQ(scene.stiffness_of_cells(), stiffness);
    EXPECT_EQ(scene.rule_of_supports(), supports);
  };
  const auto solve = [](const std::string& keys) { return scene_of("[solve]\n" + keys); };
  expect_cells(solve("level = 1\n"), Stiffness::exact, Supports::area);
  expect_cells(solve("budget_s = 1\n"), Stiffness::exact, Supports::area);
  for (const std::string nearest : {"accuracy_mm = 1\n", "accuracy_reactions = 0.1\n"}) {
    expect_cells(solve(nearest), Stiffness::condensed, Supports::soft);
    // What the scene says holds, and cells that do not go with it are not taken.
    expect_cells(solve(nearest + "stiffness = \"exact\"\n"), Stiffness::exact, Supports::area);
    expect_cells(solve(nearest + "supports = \"area\"\n"), Stiffness::condensed, Supports::area);
    expect_cells(solve(nearest + "law = \"neo-hookean\"\n"), Stiffness::exact, Supports::area);
    expect_cells(solve(nearest + "strain = \"green-lagrange\"\n"), Stiffness::exact, Supports::area);
    expect_cells(solve(nearest + "rotation = \"edges\"\n"), Stiffness::exact, Supports::area);
  }
  expect_cells(solve("level = 1\ngrading = \"scene\"\n"), Stiffness::condensed, Supports::soft);
  expect_cells(solve("grading = \"scene\"\nstiffness = \"exact\"\n"), Stiffness::exact, Supports::area);
  expect_cells(solve("accuracy_mm = 1\nreference = \"loaded\"\n[gravity]\nm_s2 = [0, 0, 1]\n"), Stiffness::exact,
               Supports::area);
  Scene scene = solve("accuracy_mm = 1\n"), kept = scene;
  scene.name_level(1);
  expect_cells(scene, Stiffness::exact, Supports::area);
  kept.keep_cells();
  kept.name_level(1);
  expect_cells(kept, Stiffness::condensed, Supports::soft);
}

TEST(Scene, AContactIsAPlaneOrASphere) {
  const Scene scene = scene_of(
      "[[contact]]\nplane = { point_mm = [1, 2, 3], normal = [0, 0, 2] }\nstiffness_n_mm = 0.5\nby_mm = [0, 0, 4]\n"
      "[[contact]]\nname = \"probe\"\nsphere = { center_mm = [1, 2, 3], radius_mm = 7 }\nstiffness_n_mm = 1\n");
  ASSERT_EQ(scene.contacts.size(), 2U);
  EXPECT_EQ(scene.contacts[0].name, "contact 1");
  EXPECT_EQ(std::get<HalfSpace>(scene.contacts[0].obstacle).normal, Vec3(0, 0, 1));
  EXPECT_EQ(scene.contacts[0].by, Vec3(0, 0, 4));
  EXPECT_EQ(scene.contacts[0].stiffness, 0.5);
  EXPECT_EQ(scene.contacts[1].name, "probe");
  EXPECT_EQ(std::get<Ball>(scene.contacts[1].obstacle).radius, 7);
  EXPECT_EQ(scene_of("[[contact]]\nself = true\nfriction = 0.1\n").contacts[0].self, "");
  EXPECT_EQ(scene_of("[[contact]]\nself = \"wall\"\n").contacts[0].self, "wall");
  EXPECT_FALSE(scene_of("[[contact]]\nbetween = [\"a\", \"b\"]\n").contacts[0].self);
  EXPECT_NE(error_of("[[contact]]\nself = false\n").find("expected true"), std::string::npos);
  EXPECT_NE(error_of("[[contact]]\nself = true\nadhesion = true\n").find("adhesion"), std::string::npos);
  EXPECT_EQ(error_of("[[contact]]\nstiffness_n_mm = 1\n"),
            "s.toml:1:1: [[contact]] has 0 obstacles, expected one of plane, sphere, capsule, cylinder, box and "
            "surface, or between, or self");
  const std::string ball = "[[contact]]\nsphere = { center_mm = [1, 2, 3], radius_mm = 7 }\n";
  EXPECT_TRUE(is_hard(scene_of(ball).contacts[0], scene_of(ball)));
  EXPECT_FALSE(is_hard(scene.contacts[1], scene));
  EXPECT_EQ(error_of(ball + "by_mm = [1, 0, 0]\nrotate = { axis = [0, 0, 1], degrees = 5, about_mm = [0, 0, 0] }\n"),
            "s.toml:1:1: [[contact]] has more than one of by_mm, rotate, velocity_mm_s and table, expected one");
  EXPECT_EQ(error_of(ball + "friction = -1\n"), "s.toml:3:12: contact.friction is -1, expected a coefficient, 0 to 10");
  EXPECT_EQ(error_of(ball + "friction = 0.5\n[solve]\naccuracy_mm = 1\n"),
            "friction of a [[contact]] in an equilibrium does not go with an accuracy or a budget_s, expected "
            "solve.level");
}

TEST(Scene, ObstaclesOfOtherShapes) {
  const Scene scene = scene_of(
      "[[contact]]\ncapsule = { from_mm = [0, 0, 0], to_mm = [0, 0, 9], radius_mm = 2 }\nfriction = 0.3\n"
      "rotate = { axis = [0, 0, 2], degrees = 90, about_mm = [1, 0, 0] }\n"
      "[[contact]]\nbox = { center_mm = [1, 2, 3], size_mm = [2, 4, 6], turned_about = [1, 0, 0], degrees = 90 }\n"
      "[[contact]]\ncylinder = { from_mm = [0, 0, 0], to_mm = [0, 0, 9], radius_mm = 2 }\n");
  ASSERT_EQ(scene.contacts.size(), 3U);
  EXPECT_EQ(scene.contacts[0].friction, 0.3);
  EXPECT_EQ(scene.error_estimation, ErrorEstimation::off);
  EXPECT_LT((place_of(scene.contacts[0], {1, 0}) * Vec3(2, 0, 5) - Vec3(1, 1, 5)).norm(), 1e-12);
  const auto& box = std::get<hexmesh::Block>(scene.contacts[1].obstacle);
  EXPECT_LT((box.axes.col(1) - Vec3::UnitZ()).norm(), 1e-12);
  EXPECT_EQ(box.half, Vec3(1, 2, 3));
  EXPECT_EQ(std::get<hexmesh::Cylinder>(scene.contacts[2].obstacle).radius, 2);
  EXPECT_EQ(error_of("[[contact]]\nbox = { center_mm = [1, 2, 3], size_mm = [2, 0, 6] }\n"),
            "s.toml:2:7: box, expected { center_mm = [x, y, z], size_mm = [x, y, z] } with sizes > 0, and where it is "
            "turned turned_about = [x, y, z] and degrees");
  EXPECT_EQ(error_of("[[contact]]\nsurface = \"none.hexsurface\"\n").find("no such surface"), 0U);
}

TEST(Scene, Prestress) {
  const Scene scene = scene_of(
      "[[prestress]]\nsegment = \"skin\"\nstretch = 1.2\nalong = [0, 0, 3]\n"
      "[[prestress]]\nsegment = \"gut\"\nstress_kpa = [1, 2, 3, 4, 5, 6]\n");
  ASSERT_EQ(scene.prestresses.size(), 2U);
  EXPECT_FALSE(scene.finds_strain);
  EXPECT_LT((*scene.prestresses[0].stretch - hexmesh::Mat3(Vec3(1, 1, 1.2).asDiagonal())).norm(), 1e-12);
  hexmesh::Mat3 stress;
  stress << 1, 4, 6, 4, 2, 5, 6, 5, 3;
  EXPECT_LT((1e3 * *scene.prestresses[1].stress - stress).norm(), 1e-12);
  const std::string skin = "[[prestress]]\nsegment = \"skin\"\n";
  EXPECT_EQ(error_of(skin), "s.toml:1:1: [[prestress]] expects one of stretch and stress_kpa");
  EXPECT_EQ(error_of(skin + "stretch = 7\n"), "s.toml:3:11: prestress.stretch is 7, expected 0.2 to 5");
  EXPECT_EQ(error_of(skin + "stretch = 2\n" + skin + "stress_kpa = 1\n"),
            "s.toml:4:1: segment is 'skin' as at s.toml:1:1, expected another");
}

TEST(Scene, TheLengthOfANormalDoesNotMatter) {
  for (const char* normal : {"[0, 0, 1e200]", "[0, 0, 1e-200]", "[0, 0, 3]"}) {
    const Scene scene =
        scene_of(std::string("[[fix]]\nhalfspace = { point_mm = [0, 0, 0], normal = ") + normal + " }\n");
    EXPECT_LT((scene.conditions[0].selection.halfspace->normal - Vec3(0, 0, 1)).norm(), 1e-12) << normal;
  }
}

TEST(Scene, FilesThatAreNoneAndKeysThatAreDeepAreRefused) {
  const auto message = [](const std::filesystem::path& path) {
    return message_of(ErrorKind::input, [&] { read_scene(path, path.string()); });
  };
  EXPECT_EQ(message("/dev/zero"), "'/dev/zero' is no file, expected one");
  EXPECT_EQ(message("/tmp"), "'/tmp' is no file, expected one");
  std::string key = "a";
  for (int n = 0; n < 200000; ++n) key += ".a";
  EXPECT_NE(error_of("# a.b.c\nname = \"...\"\n" + key + " = 1\n").find("s.toml:3: a key of more than 64 parts"),
            std::string::npos);
}

}  // namespace test_scene
