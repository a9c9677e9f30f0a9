// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "constraints/patch_springs.h"
#include "hexsolver/equilibrium/equilibrium.h"
#include "hexsolver/scene/scene_files.h"
#include "level/level_problem.h"
#include "support/bodies.h"
#include "support/solve.h"

/// solve.supports = "soft": springs on what of a patch cells do not hold firmly.
namespace test_patch_springs {

using namespace hexsolver;
using namespace testing_support;

Lattice bar() {
  return one_material({48, 16, 16}, {1, 1, 1}, [](const Index3&) { return true; });
}

/// A bar that is held at two patches of one side and pulled at a third.
Scene pulled(const std::string& solve) {
  return parse_scene("[solve]\n" + solve + R"(
[[fix]]
name = "near"
point_mm = [9, 7.5, 15.5]
radius_mm = 5
[[fix]]
name = "far"
point_mm = [44, 8, -0.5]
radius_mm = 4.2
[[displace]]
name = "pulled"
point_mm = [25, 7, -0.5]
radius_mm = 4.6
by_mm = [0, 1, 2]
)",
                     "test", "");
}

TEST(PatchSprings, AreAHalfSpaceUnderWhatVoxelsSeeAndCellsDoNot) {
  // mu = 40 kPa at nu = 0.25; cells of 2 x 4 x 8 mm of voxels of 1 x 1 x 1: 2 pi mu / ((1 - nu) (h - h_0)) for each
  // area.
  ElementModel cell;
  cell.shear = 0.04;
  cell.bulk = 2 * 0.04 * 1.25 / (3 * 0.5);
  ConstraintPoint point;
  point.area = 3;
  const double pi = std::acos(-1.0);
  EXPECT_NEAR(PatchSprings::stiffness(point, cell, Vec3(2, 4, 8).asDiagonal(), 1), 3 * 2 * pi * 0.04 / (0.75 * 3),
              1e-14);
  EXPECT_NEAR(PatchSprings::stiffness(point, cell, Vec3(2, 1, 1).asDiagonal(), 2),
              3 * 2 * pi * 0.04 / (0.75 * std::cbrt(2) / 4), 1e-14)
      << "of a voxel beside larger cells";
}

TEST(PatchSprings, NodesAndVoxelsHaveNone) {
  const Lattice lattice = bar();
  for (const char* on : {"nodes", "voxels"}) {
    const auto held = [&](const char* supports) {
      SolveReport report;
      const Scene scene = parse_scene(std::string("[solve]\nerror_estimate = \"off\"\nsupports = \"") + supports +
                                          "\"\n[[fix]]\nhalfspace = { point_mm = [0.6, 0, 0], normal = [-1, 0, 0] }\n" +
                                          "on = \"" + on + "\"\n[gravity]\nm_s2 = [0, 0, -1]\n",
                                      "test", "");
      return solve_equilibrium(lattice, scene, 1, report).displacement;
    };
    const std::vector<Vec3> soft = held("soft"), firm = held("area");
    ASSERT_EQ(soft.size(), firm.size());
    for (std::size_t n = 0; n < soft.size(); ++n) EXPECT_LT((soft[n] - firm[n]).norm(), 1e-6) << on;
  }
}

TEST(PatchSprings, TheirForcesAreTheDerivativeOfTheirEnergy) {
  const Lattice lattice = bar();
  for (const char* grading : {"off", "scene"}) {
    const Scene scene = pulled(std::string("supports = \"soft\"\ncoarser_by = 1\ngrading = \"") + grading + '"');
    LevelProblem problem(lattice, scene, 1);
    problem.build_potential(Elasticity::cauchy, {});
    const PatchSprings springs(problem.mesh(), problem.constraints().held());
    const auto dofs = 3 * problem.mesh().num_all_nodes();
    const NodeVector u = noise(dofs, 1), direction = noise(dofs, 1, 7);
    NodeVector gradient = NodeVector::Zero(u.size()), magnitude = gradient, product = gradient;
    springs.add_gradient(u, gradient, magnitude);
    springs.add_product(direction, product);
    // Quadratic: central differences are exact but for rounding.
    const double slope = (springs.energy(u + direction) - springs.energy(u - direction)) / 2;
    EXPECT_NEAR(gradient.dot(direction), slope, 1e-12 * springs.energy(u));
    EXPECT_NEAR(product.dot(direction),
                springs.energy(u + direction) + springs.energy(u - direction) - 2 * springs.energy(u),
                1e-12 * springs.energy(u));
    EXPECT_GT(springs.energy(u), 0);
  }
}

TEST(PatchSprings, WithReactionsTheyBalanceTheBody) {
  const Lattice lattice = bar();
  for (const char* more : {"strain = \"cauchy\"", "strain = \"cauchy\"\ngrading = \"scene\"\ncoarser_by = 1",
                           "strain = \"corotational\""}) {
    SolveReport report;
    solve_equilibrium(lattice, pulled(std::string("supports = \"soft\"\ntolerance = 1e-10\n") + more), 2, report);
    Vec3 sum = Vec3::Zero();
    double largest = 0;
    for (const ConditionReport& c : report.conditions) {
      sum += c.reaction_n;
      largest = std::max(largest, c.reaction_n.norm());
      EXPECT_GT(c.kept, 2U) << "the mean of each patch";
    }
    EXPECT_LT(sum.norm(), 1e-8 * largest) << more;
  }
}

/// What acts on a patch of many cells does not go through its springs, which would let it sink in; where cells are as
/// large as the patch these give way as the body around it would.
TEST(PatchSprings, TheMeanOfAPatchOfManyCellsIsHeld) {
  const Lattice lattice = bar();
  const auto mean_of_pulled = [&](int level) {
    SolveReport report;
    const hexmesh::Result result = solve_equilibrium(
        lattice, pulled("supports = \"soft\"\nstrain = \"cauchy\"\ntolerance = 1e-10"), level, report);
    const std::vector<Vec3>& u = result.conditions[2].displacement;
    return Vec3(std::accumulate(u.begin(), u.end(), Vec3(Vec3::Zero())) / static_cast<double>(u.size()));
  };
  EXPECT_LT((mean_of_pulled(1) - Vec3(0, 1, 2)).norm(), 1e-8) << "17 faces of cells of 2 mm";
  EXPECT_GT((mean_of_pulled(2) - Vec3(0, 1, 2)).norm(), 1e-3) << "4 of 4 mm";
}

/// More than a thousand nodes: those in the middle of the patch are held, springs hold its rim.
TEST(PatchSprings, LargePatchesEndWhereTheyEnd) {
  hexmesh::LatticeOptions options;
  options.offset = {1, 0, 0};
  const auto volume = make_volume({24, 46, 46}, {1, 1, 1}, [](const Index3&) { return 1; });
  const Lattice lattice = hexmesh::build_lattice(
      volume, {{volume.segments[0], hexmesh::material_from_units(100, 0.3, 1000), 0, ""}}, options);
  std::vector<Vec3> places;
  for (int k = 0; k < 46; k += 3)
    for (int j = 0; j < 46; j += 3)
      for (int i = 0; i < 24; ++i) places.emplace_back(i, j, k);
  const auto solved = [&](const std::string& supports, int level, SolveReport& report, const char* grading = "off") {
    const Scene scene = parse_scene("[solve]\nstrain = \"cauchy\"\ntolerance = 1e-10\ncoarser_by = 1\ngrading = \"" +
                                        std::string(grading) + "\"\nsupports = \"" + supports +
                                        "\"\n[[fix]]\nbox_mm = [-1, 2.6, -1, 46, -1, 46]\n"
                                        "[[force]]\nnewton = [0.5, 1, 0]\nbox_mm = [23, 24, -1, 46, -1, 46]\n",
                                    "test", "");
    return displacement_inside(solve_equilibrium(lattice, scene, level, report), places);
  };
  SolveReport exact, soft, firm;
  const std::vector<Vec3> voxels = solved("area", 0, exact), springs = solved("soft", 1, soft),
                          nodes = solved("area", 1, firm);
  EXPECT_GT(firm.kept_directions, 3U * 1000) << "nodes";
  EXPECT_LT(soft.kept_directions, firm.kept_directions);
  EXPECT_LT((soft.conditions[0].reaction_n + Vec3(0.5, 1, 0)).norm(), 1e-8);
  EXPECT_LT(mean_distance(springs, voxels), 0.5 * mean_distance(nodes, voxels))
      << mean_distance(springs, voxels) << " of " << mean_distance(nodes, voxels);

  // Voxels at the rim, larger cells in the middle: springs hold what of both is not held.
  const std::vector<Vec3> graded = solved("soft", 0, soft, "scene");
  EXPECT_LT((soft.conditions[0].reaction_n + Vec3(0.5, 1, 0)).norm(), 1e-8);
  EXPECT_LT(mean_distance(graded, voxels), mean_distance(springs, voxels))
      << mean_distance(graded, voxels) << " of " << mean_distance(springs, voxels);
}

TEST(PatchSprings, AFaceOfSeveralConditionsHasOne) {
  const Lattice lattice = bar();
  for (const char* grading : {"off", "scene"}) {
    const Scene once =
        pulled(std::string("supports = \"soft\"\ntolerance = 1e-11\ncoarser_by = 1\ngrading = \"") + grading + '"');
    Scene often = once;
    for (int n = 0; n < 3; ++n) often.conditions.push_back(once.conditions.back());
    SolveReport a, b;
    const hexmesh::Result one = solve_equilibrium(lattice, once, 2, a), four = solve_equilibrium(lattice, often, 2, b);
    EXPECT_LT(mean_distance(one.displacement, four.displacement), 1e-8) << grading;
    Vec3 sum = Vec3::Zero();
    for (std::size_t c = 2; c < b.conditions.size(); ++c) sum += b.conditions[c].reaction_n;
    EXPECT_LT((sum - a.conditions[2].reaction_n).norm(), 1e-6 * sum.norm()) << grading;
  }
}

TEST(PatchSprings, OfLevelZeroThereAreNone) {
  const Lattice lattice = one_material({12, 6, 6}, {4, 3, 3}, [](const Index3&) { return true; });
  SolveReport soft, firm;
  const hexmesh::Result a = solve_equilibrium(
                            lattice, pulled("strain = \"corotational\"\ntolerance = 1e-12\nsupports = \"soft\""), 0,
                            soft),
                        b = solve_equilibrium(
                            lattice, pulled("strain = \"corotational\"\ntolerance = 1e-12\nsupports = \"area\""), 0,
                            firm);
  EXPECT_LT(mean_distance(a.displacement, b.displacement), 1e-9) << "where coarser levels began is another place";
  EXPECT_EQ(soft.kept_directions, firm.kept_directions);
}

/// A patch that is small beside its cells, and alone: springs on it would let the body turn.
TEST(PatchSprings, WhatHoldsAloneHoldsTurnsFirmly) {
  const Lattice lattice = bar();
  for (const double radius : {1.7, 2.5}) {
    SolveReport report;
    const hexmesh::Result result = solve_equilibrium(
        lattice,
        parse_scene("[solve]\nsupports = \"soft\"\nstrain = \"cauchy\"\n[[fix]]\npoint_mm = [-0.5, 8, 8]\n"
                    "radius_mm = " +
                        std::to_string(radius) + "\n[gravity]\nm_s2 = [0, 0, -0.1]\n",
                    "test", ""),
        2, report);
    EXPECT_GE(report.kept_directions, 6U);
    double largest = 0;
    for (const Vec3& u : result.displacement) largest = std::max(largest, u.norm());
    EXPECT_LT(report.conditions[0].misfit_mm, 0.1 * largest) << radius;
  }
}

/// What moves a patch stretches its springs: a slow motion has the energy that was given to it.
TEST(PatchSprings, WhatMovesThemGivesTheBodyEnergy) {
  const Lattice lattice = bar();
  for (const char* integrator : {"implicit-euler", "bdf2"}) {
    const Scene scene = parse_scene(std::string(R"(
[solve]
kind = "dynamics"
supports = "soft"
stiffness = "incompatible"
tolerance = 1e-9
[dynamics]
step_s = 0.004
duration_s = 0.3
output_every = 25
integrator = ")") + integrator + R"("
[[fix]]
point_mm = [9, 7.5, 15.5]
radius_mm = 5
[[displace]]
point_mm = [26, 7, -0.5]
radius_mm = 4.6
table = [[0, 0, 0, 0], [0.3, 0, 1, 2]]
)",
                                    "test", "");
    SolveReport report;
    solve_dynamics(lattice, scene, 2, report);
    const auto& last = report.motion->rows.back();
    EXPECT_GT(last.energies.contact, 0.01 * last.energies.total()) << "of the springs";
    EXPECT_NEAR(last.energies.total(), last.work, 0.05 * last.work) << integrator;
  }
}

/// A patch that ends within cells: held firmly it is larger than it is, and the nearest nodes reach beyond it.
TEST(PatchSprings, PatchesEndWhereTheyEnd) {
  std::vector<double> soft, firm;
  for (const Index3& offset : {Index3{0, 0, 0}, Index3{3, 1, 2}, Index3{5, 6, 1}, Index3{2, 7, 4}}) {
    hexmesh::LatticeOptions options;
    options.offset = offset;
    const auto volume = make_volume({48, 16, 16}, {1, 1, 1}, [](const Index3&) { return 1; });
    const Lattice lattice = hexmesh::build_lattice(
        volume, {{volume.segments[0], hexmesh::material_from_units(100, 0.3, 1000), 0, ""}}, options);
    std::vector<Vec3> places;
    for (int k = 0; k < 16; ++k)
      for (int j = 0; j < 16; ++j)
        for (int i = 0; i < 48; ++i) places.emplace_back(i, j, k);
    const auto displacement = [&](const char* supports, int level) {
      SolveReport report;
      return displacement_inside(
          solve_equilibrium(lattice, pulled(std::string("strain = \"cauchy\"\nsupports = \"") + supports + '"'), level,
                            report),
          places);
    };
    const std::vector<Vec3> exact = displacement("area", 0);
    soft.push_back(mean_distance(displacement("soft", 2), exact));
    firm.push_back(mean_distance(displacement("area", 2), exact));
  }
  const auto mean = [](const std::vector<double>& v) { return std::accumulate(v.begin(), v.end(), 0.0) / 4; };
  EXPECT_LT(mean(soft), 0.8 * mean(firm)) << mean(soft) << " of " << mean(firm);
  EXPECT_LT(*std::max_element(soft.begin(), soft.end()), *std::max_element(firm.begin(), firm.end()));
  EXPECT_LT(mean(soft), 0.1);
}

}  // namespace test_patch_springs
