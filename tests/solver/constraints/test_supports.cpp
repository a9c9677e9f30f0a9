// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "constraints/select_points.h"
#include "constraints/supports.h"
#include "hexmesh/lattice/locator.h"
#include "hexsolver/equilibrium/equilibrium.h"
#include "hexsolver/plan/plan.h"
#include "selection/selection.h"
#include "support/bodies.h"
#include "support/files.h"
#include "support/solve.h"

namespace test_supports {

using namespace hexsolver;
using namespace testing_support;
using hexmesh::ErrorKind;

std::vector<std::string> free_of(const Lattice& lattice, const std::function<bool(const Vec3&)>& held) {
  const Body body(lattice, 0, Elasticity::cauchy);
  std::vector<std::string> words;
  for (const FreePart& part :
       free_parts(body.mesh, hold_nodes(body.mesh, held, [](const Vec3&) { return Vec3::Zero(); })))
    words.insert(words.end(), part.motions.begin(), part.motions.end());
  return words;
}

bool at(const Vec3& x, double a, double b, double c) { return (x - Vec3(a, b, c)).norm() < 1e-9; }

Lattice from(const Index3& extent, const std::function<int(const Index3&)>& label) {
  const auto volume = make_volume(extent, {1, 1, 1}, label);
  return hexmesh::build_lattice(volume, {{volume.segments[0], hexmesh::material_from_units(100, 0.3, 1000), 0, ""}});
}

Condition fix_ball(const Vec3& center, double radius) {
  Condition c;
  c.name = "held";
  c.where = "s.toml:1:1";
  c.selection.balls = {{center, radius}};
  return c;
}

std::vector<ConstraintPoint> selected(const Scene& scene, const Lattice& lattice, int level, const Mesh& mesh) {
  Selector selector({lattice, level}, mesh);
  return with_face_centers(select_points(scene, selector));
}

TEST(Supports, NothingHeldIsToldWithAllSixMotions) {
  const auto words = free_of(box({4, 4, 4}, {1, 1, 1}), [](const Vec3&) { return false; });
  ASSERT_EQ(words.size(), 1U);
  EXPECT_NE(words[0].find("held by nothing"), std::string::npos);
}

TEST(Supports, OnePointLeavesThreeTurnsAboutIt) {
  const auto words = free_of(box({4, 4, 4}, {1, 1, 1}), [](const Vec3& x) { return at(x, -0.5, -0.5, -0.5); });
  ASSERT_EQ(words.size(), 3U);
  for (const std::string& w : words) EXPECT_NE(w.find("free to turn"), std::string::npos) << w;
}

TEST(Supports, TwoPointsLeaveTheTurnAboutTheLineBetweenThem) {
  const auto words = free_of(box({4, 4, 4}, {1, 1, 1}),
                             [](const Vec3& x) { return at(x, -0.5, -0.5, -0.5) || at(x, 3.5, -0.5, -0.5); });
  ASSERT_EQ(words.size(), 1U);
  EXPECT_TRUE(words[0].find("axis [1.00, ") != std::string::npos || words[0].find("axis [-1.00, ") != std::string::npos)
      << words[0];
}

TEST(Supports, ThreePointsHold) {
  EXPECT_TRUE(free_of(box({4, 4, 4}, {1, 1, 1}), [](const Vec3& x) {
                return at(x, -0.5, -0.5, -0.5) || at(x, 3.5, -0.5, -0.5) || at(x, -0.5, 3.5, -0.5);
              }).empty());
}

TEST(Supports, AnIslandIsFound) {
  const Lattice lattice = from({6, 2, 2}, [](const Index3& v) { return v[0] != 3; });
  const auto words = free_of(lattice, [](const Vec3& x) { return x[0] < 0; });
  ASSERT_EQ(words.size(), 1U);
  EXPECT_NE(words[0].find("part of 8 cells"), std::string::npos) << words[0];
}

TEST(Supports, PartsJoinedByAnEdgeCanHinge) {
  const Lattice lattice = from({2, 2, 2}, [](const Index3& v) { return v[0] == v[1]; });
  const auto words = free_of(lattice, [](const Vec3& x) { return x[0] < 0; });
  ASSERT_EQ(words.size(), 1U);
  EXPECT_NE(words[0].find("free to turn about the axis"), std::string::npos) << words[0];
}

TEST(Supports, AScaleOfMillionsOfMillimetresChangesNothing) {
  for (const double size : {1e-3, 1e3}) {
    const Lattice lattice = box({4, 4, 4}, Vec3::Constant(size));
    EXPECT_TRUE(free_of(lattice, [&](const Vec3& x) { return x[0] < 0; }).empty());
  }
}

TEST(Selection, APointFarFromTheBodyIsNamedWithItsDistance) {
  const Lattice lattice = box({10, 10, 10}, {1, 1, 1});
  const Body body(lattice, 0, Elasticity::cauchy);
  Scene scene;
  scene.conditions = {fix_ball({-50.5, 4.5, 4.5}, 3)};
  const std::string message = message_of(ErrorKind::geometry, [&] { selected(scene, lattice, 0, body.mesh); });
  EXPECT_NE(message.find("condition 'held' (s.toml:1:1)"), std::string::npos) << message;
  EXPECT_NE(message.find("50.0 mm"), std::string::npos) << message;
}

TEST(AreaOfAPatch, IsSeenAlikeHoweverManyVoxelsACellHas) {
  // The same body with cells of 4 mm, of 4, 2 and 1 mm voxels: half of its upper side is held, up to a line across
  // cells.
  std::vector<NodeVector> lifts;
  std::vector<std::size_t> kept;
  for (const int per_cell : {1, 2, 4}) {
    const double h = 4.0 / per_cell;
    const Lattice lattice = box({4 * per_cell, 3 * per_cell, 2 * per_cell}, {h, h, h});
    const int level = per_cell == 4 ? 2 : per_cell - 1;
    const Body body(lattice, level, Elasticity::cauchy);
    ASSERT_EQ(body.mesh.num_cells(), 24U);
    Scene scene;
    Condition half;
    half.name = half.where = "half";
    const double top = (2 * per_cell - 0.5) * h, low = -0.5 * h;
    half.selection.box = hexmesh::Box{Mat3(Vec3(1 / 8.01, 1 / 50.0, 1 / 0.01).asDiagonal()), {low, low, top}};
    half.by = {1, 2, 3};
    scene.conditions = {half};
    Selector selector({lattice, level}, body.mesh);
    const Constraints constraints(body.mesh, select_points(scene, selector));
    kept.push_back(constraints.num_kept());
    lifts.push_back(constraints.lift(NodeVector::Zero(static_cast<Eigen::Index>(body.mesh.num_dofs()))));
  }
  EXPECT_EQ(kept[0], 3U * 3 * 4);  // the nodes of the two rows of cells, along three axes
  for (std::size_t n = 1; n < lifts.size(); ++n) {
    EXPECT_EQ(kept[n], kept[0]);
    EXPECT_LT((lifts[n] - lifts[0]).norm(), 1e-9 * lifts[0].norm());
  }
}

TEST(AreaOfAPatch, FacesOfLongVoxelsCountByTheirArea) {
  // Forces of a uniform pressure, which two faces of different area balance in proportion.
  const Lattice lattice = box({1, 1, 1}, {1, 2, 5});
  const Body body(lattice, 0, Elasticity::cauchy);
  Scene scene;
  scene.conditions = {fix_ball({0, 0, 0}, 10)};
  Selector selector({lattice, 0}, body.mesh);
  const std::vector<ConstraintPoint> points = select_points(scene, selector);
  ASSERT_EQ(points.size(), 24U);  // four Gauss points of six faces
  double area = 0;
  for (const ConstraintPoint& p : points) area += p.area;
  EXPECT_NEAR(area, 2 * (2 + 5 + 10), 1e-12);
  const std::vector<ConstraintPoint> centers = with_face_centers(points);
  ASSERT_EQ(centers.size(), 6U);
  for (const ConstraintPoint& p : centers) {
    const Vec3 x = body.mesh.rest_position(p.cell, p.weights);
    EXPECT_NEAR(x.cwiseQuotient(Vec3(0.5, 1, 2.5)).cwiseAbs().maxCoeff(), 1, 1e-12);
    EXPECT_NEAR(x.cwiseAbs().sum(), x.cwiseAbs().maxCoeff(), 1e-12);  // the middle of a face
  }
}

TEST(Selection, ABallTakesItsFacesAndRadiusZeroTheNearest) {
  const Lattice lattice = box({10, 10, 10}, {1, 1, 1});
  const Body body(lattice, 1, Elasticity::cauchy);
  Scene scene;
  scene.conditions = {fix_ball({-0.5, 4, 4}, 1.01)};
  EXPECT_EQ(selected(scene, lattice, 1, body.mesh).size(), 5U);
  scene.conditions[0].selection.balls[0].radius = 0;
  const auto one = selected(scene, lattice, 1, body.mesh);
  ASSERT_EQ(one.size(), 1U);
  Vec3 position = Vec3::Zero();
  for (int a = 0; a < 8; ++a)
    position += one[0].weights[a] *
                body.mesh.position(static_cast<std::size_t>(
                    body.mesh.cell_nodes()[static_cast<std::size_t>(one[0].cell)][static_cast<std::size_t>(a)]));
  EXPECT_LT((position - Vec3(-0.5, 4, 4)).norm(), 1e-12);
}

TEST(Selection, TheBoundaryWithASegmentWithoutMaterialIsFound) {
  const auto volume = make_volume({4, 3, 3}, {1, 1, 1}, [](const Index3& v) { return v[0] == 3 ? 2 : 1; });
  const Lattice lattice = hexmesh::build_lattice(
      volume, {{volume.segments[0], hexmesh::material_from_units(100, 0.3, 1000), 0, ""}, {volume.segments[1], {}, 0}});
  const Body body(lattice, 0, Elasticity::cauchy);
  Scene scene;
  Condition c;
  c.selection.segment = "segment_2";
  scene.conditions = {c};
  EXPECT_EQ(selected(scene, lattice, 0, body.mesh).size(), 9U);
  scene.conditions[0].selection.segment = "vena_cava";
  EXPECT_NE(message_of(ErrorKind::input, [&] { selected(scene, lattice, 0, body.mesh); })
                .find("expected one of: segment_1, segment_2"),
            std::string::npos);
}

TEST(Equilibrium, ContradictingConditionsAreNamedBeforeAnythingIsSolved) {
  const Lattice lattice = box({10, 10, 10}, {1, 1, 1});
  Scene scene;
  scene.conditions = {fix_ball({-0.5, 4, 4}, 4), fix_ball({-0.5, 4, 4}, 4)};
  scene.conditions[1].name = "pulled";
  scene.conditions[1].by = {5, 0, 0};
  SolveReport report;
  const std::string message = message_of(ErrorKind::geometry, [&] { solve_equilibrium(lattice, scene, 0, report); });
  EXPECT_NE(message.find("'held'"), std::string::npos) << message;
  EXPECT_NE(message.find("'pulled'"), std::string::npos) << message;
}

TEST(Equilibrium, ReactionsBalance) {
  const Lattice lattice = bitten_ball({1, 1, 1});
  Scene scene;
  scene.conditions = {fix_ball({10, -13, 36}, 4), fix_ball({26, -13, 36}, 4)};
  scene.conditions[1].name = "pulled";
  scene.conditions[1].by = {2, 3, -1};
  SolveReport report;
  const hexmesh::Result result = solve_equilibrium(lattice, scene, 0, report);
  ASSERT_TRUE(report.converged) << report.reason;
  EXPECT_LT(report.constraint_violation_mm, 1e-6);
  const Vec3 sum = report.conditions[0].reaction_n + report.conditions[1].reaction_n;
  EXPECT_LT(sum.norm(), 1e-6 * report.conditions[0].reaction_n.norm());
  EXPECT_GT(report.conditions[1].reaction_n.dot(Vec3(2, 3, -1)), 0);
  EXPECT_EQ(result.displacement.size(), result.nodes.size());
}

TEST(Equilibrium, AnOverriddenModulusScalesTheReaction) {
  const Lattice lattice = box({8, 8, 8}, {1, 1, 1});
  Scene scene;
  scene.conditions = {fix_ball({-0.5, 3.5, 3.5}, 3), fix_ball({7.5, 3.5, 3.5}, 3)};
  scene.conditions[1].by = {1, 0, 0};
  SolveReport soft, stiff;
  solve_equilibrium(lattice, scene, 1, soft);
  scene.materials["segment_1"].young_kpa = 300;
  solve_equilibrium(with_overrides(lattice, scene), scene, 1, stiff);
  EXPECT_NEAR(stiff.conditions[1].reaction_n[0] / soft.conditions[1].reaction_n[0], 3, 1e-6);
  scene.materials = {{"spleen", {}}};
  EXPECT_NE(message_of(ErrorKind::input, [&] { with_overrides(lattice, scene); })
                .find("material.spleen is no segment with a material"),
            std::string::npos);
}

// Two blocks and a speck that nothing holds.
Lattice block_with_a_speck() {
  return from({8, 4, 4}, [](const Index3& v) { return v[0] < 4 || (v[0] == 6 && v[1] == 1 && v[2] == 1); });
}

Scene pulled_block(Islands islands) {
  Scene scene;
  scene.islands = islands;
  scene.conditions = {fix_ball({-0.5, 1.5, 1.5}, 3), fix_ball({3.5, 1.5, 1.5}, 1.6)};
  scene.conditions[1].name = "pulled";
  scene.conditions[1].by = {0.5, 0, 0};
  return scene;
}

TEST(Islands, AreAnErrorThatSaysWhatElseCouldBeDone) {
  SolveReport report;
  const std::string message = message_of(
      ErrorKind::geometry, [&] { solve_equilibrium(block_with_a_speck(), pulled_block(Islands::error), 0, report); });
  EXPECT_NE(message.find("of 1 cells"), std::string::npos) << message;
  EXPECT_NE(message.find("solve.islands"), std::string::npos) << message;
}

TEST(Islands, AreKnownBeforeASolution) {
  const Lattice block = block_with_a_speck();
  EXPECT_TRUE(leaves_islands_out(block, pulled_block(Islands::drop), 0));
  EXPECT_FALSE(leaves_islands_out(block, pulled_block(Islands::hold), 0));
  EXPECT_FALSE(leaves_islands_out(block, pulled_block(Islands::error), 0));
  EXPECT_EQ(plan_solution(block, pulled_block(Islands::drop), 0).levels.back().cells, 64U);
}

TEST(Islands, LeftOutOrHeldTheRestDoesWhatItDoesWithoutThem) {
  const Lattice alone = from({8, 4, 4}, [](const Index3& v) { return v[0] < 4; });
  Scene scene = pulled_block(Islands::error);
  Force force;  // onto all faces towards -z, those of the speck too
  force.name = "push";
  force.selection.halfspace = HalfSpace{{0, 0, 1.2}, {0, 0, -1}};
  force.total = {0, 0, 0.01};
  SolveReport expected;
  solve_equilibrium(alone, scene, 0, expected);

  scene.islands = Islands::drop;
  scene.forces = {force};
  scene.gravity = {0, 9810, 0};
  SolveReport dropped;
  const hexmesh::Result rest = solve_equilibrium(block_with_a_speck(), scene, 0, dropped);
  EXPECT_TRUE(dropped.converged) << dropped.reason;
  EXPECT_EQ(dropped.dropped_cells, 1U);
  EXPECT_EQ(rest.cells.size(), 64U);
  EXPECT_GT(dropped.min_jacobian, 0.5);
  ASSERT_EQ(dropped.warnings.size(), 1U);
  EXPECT_NE(dropped.warnings[0].find("1 of 65 cells of level 0 are left out"), std::string::npos);
  // All of the loads reach the supports of what is left.
  Vec3 sum = dropped.forces[0].total_n + dropped.forces[1].total_n;
  EXPECT_NEAR((dropped.forces[0].total_n - force.total).norm(), 0, 1e-12);
  for (const ConditionReport& c : dropped.conditions) sum += c.reaction_n;
  EXPECT_NEAR(sum.norm(), 0, 1e-8);

  scene = pulled_block(Islands::hold);
  SolveReport held;
  const hexmesh::Result result = solve_equilibrium(block_with_a_speck(), scene, 0, held);
  EXPECT_TRUE(held.converged) << held.reason;
  EXPECT_EQ(held.held_cells, 1U);
  EXPECT_EQ(held.dropped_cells, 0U);
  EXPECT_NEAR(held.strain_energy_n_mm, expected.strain_energy_n_mm, 1e-9 * expected.strain_energy_n_mm);
  for (std::size_t n = 0; n < result.nodes.size(); ++n)
    if (result.nodes[n][0] > 5) {
      EXPECT_LT(result.displacement[n].norm(), 1e-9);
    }
  const std::vector<double>& marked = result.cell_fields.at("island");
  EXPECT_EQ(std::count(marked.begin(), marked.end(), 1.0), 1);

  // With weight: supports and springs carry it together.
  scene.gravity = {0, 0, -9810};
  SolveReport heavy;
  solve_equilibrium(block_with_a_speck(), scene, 0, heavy);
  EXPECT_GT(heavy.held_force_n[2], 0);
  Vec3 balance = heavy.held_force_n;
  for (const ForceReport& f : heavy.forces) balance += f.total_n;
  for (const ConditionReport& c : heavy.conditions) balance += c.reaction_n;
  EXPECT_LT(balance.norm(), 1e-9);  // the springs bear 1e-5 N
}

TEST(Islands, ThatHangOnByAnEdgeAreLeftOut) {
  // The cube at the block's edge x = 3.5, z = 3.5 could turn about it.
  const Lattice lattice =
      from({5, 4, 5}, [](const Index3& v) { return (v[0] < 4 && v[2] < 4) || (v[0] == 4 && v[1] == 1 && v[2] == 4); });
  for (const Islands islands : {Islands::drop, Islands::hold}) {
    Scene scene = pulled_block(islands);
    scene.conditions[0].by = scene.conditions[1].by = {30, 0, 0};  // the block as a whole
    SolveReport report;
    const hexmesh::Result result = solve_equilibrium(lattice, scene, 0, report);
    EXPECT_TRUE(report.converged) << report.reason;
    EXPECT_EQ(report.dropped_cells, 1U);
    EXPECT_LE(report.levels.back().newton.iterations, 6);
    EXPECT_EQ(report.inverted_cells, 0U);
    for (const Vec3& u : result.displacement) EXPECT_NEAR((u - Vec3(30, 0, 0)).norm(), 0, 1e-6);
  }
}

TEST(Islands, TheWholeBodyIsNone) {
  for (const Islands islands : {Islands::drop, Islands::hold}) {
    Scene scene;
    scene.islands = islands;
    scene.gravity = {0, 0, -9810};
    SolveReport report;
    const std::string message = message_of(ErrorKind::geometry, [&] {
      solve_equilibrium(box({4, 4, 4}, {1, 1, 1}), scene, 0, report);
    });
    EXPECT_NE(message.find("held by nothing"), std::string::npos) << message;
    EXPECT_EQ(message.find("solve.islands"), std::string::npos) << message;
  }
}

TEST(Islands, AConditionOnANodeThatPartsShareHoldsTheOneThatIsHeldOtherwise) {
  const Lattice lattice =
      from({5, 4, 5}, [](const Index3& v) { return (v[0] < 4 && v[2] < 4) || (v[0] == 4 && v[1] == 1 && v[2] == 4); });
  Scene scene = pulled_block(Islands::drop);
  for (Condition& c : scene.conditions) c.selection.on = SurfacePoints::nodes;
  scene.conditions.push_back(fix_ball({3.5, 0.5, 3.5}, 0.1));  // a node of the edge
  scene.conditions.back().selection.on = SurfacePoints::nodes;
  SolveReport report;
  solve_equilibrium(lattice, scene, 0, report);
  EXPECT_TRUE(report.converged) << report.reason;
  EXPECT_EQ(report.dropped_cells, 1U);
}

TEST(Nested, ACoarserLevelThatCannotBeSetUpIsNoStart) {
  // One node, which has no face's centre within the radius on coarser levels.
  const Lattice lattice = box({16, 8, 8}, {1, 1, 1});
  Scene scene;
  scene.conditions = {fix_ball({-0.5, -0.5, -0.5}, 0.1), fix_ball({-0.5, 7.5, -0.5}, 0.1),
                      fix_ball({15.5, -0.5, -0.5}, 0.1)};
  for (Condition& c : scene.conditions) c.selection.on = SurfacePoints::nodes;
  scene.gravity = {0, 0, 98};
  SolveReport report;
  solve_equilibrium(lattice, scene, 0, report);
  EXPECT_TRUE(report.converged) << report.reason;
  ASSERT_EQ(report.levels.size(), 1U);
  EXPECT_FALSE(report.levels[0].error.mean_mm.has_value());

  // With an accuracy the level is not known beforehand, and neither are its nodes.
  scene.accuracy = 1;
  SolveReport refused;
  EXPECT_NE(message_of(ErrorKind::input, [&] { solve_equilibrium(lattice, scene, 0, refused); }).find("\"nodes\""),
            std::string::npos);
}

TEST(Conflicts, AreMetByLeastSquaresIfAsked) {
  const Lattice lattice = box({8, 4, 4}, {1, 1, 1});
  Scene scene;
  scene.conditions = {fix_ball({-0.5, 1.5, 1.5}, 3), fix_ball({7.5, 1.5, 1.5}, 3), fix_ball({7.5, 1.5, 1.5}, 3)};
  scene.conditions[1].by = {0.5, 0, 0};
  scene.conditions[2].by = {0.7, 0, 0};
  SolveReport refused;
  EXPECT_NE(message_of(ErrorKind::geometry, [&] { solve_equilibrium(lattice, scene, 0, refused); }).find("compromise"),
            std::string::npos);
  scene.compromise = true;
  SolveReport report;
  solve_equilibrium(lattice, scene, 0, report);
  EXPECT_TRUE(report.converged) << report.reason;
  ASSERT_EQ(report.warnings.size(), 1U);
  EXPECT_NE(report.warnings[0].find("least squares"), std::string::npos);
  EXPECT_NEAR(report.conditions[1].misfit_mm, 0.1, 1e-5);
  EXPECT_NEAR(report.conditions[2].misfit_mm, 0.1, 1e-5);
}

TEST(Conflicts, CompromisesHoldOnEveryLevelOfABudget) {
  const Lattice lattice = box({16, 8, 8}, {1, 1, 1});
  Scene scene;
  scene.compromise = true;
  scene.budget = 1000;
  scene.conditions = {fix_ball({-0.5, 3.5, 3.5}, 3), fix_ball({15.5, 3.5, 3.5}, 3), fix_ball({15.5, 3.5, 3.5}, 3)};
  scene.conditions[1].by = {0.5, 0, 0};
  scene.conditions[2].by = {0.7, 0, 0};
  SolveReport report;
  solve_equilibrium(lattice, scene, 0, report);
  EXPECT_TRUE(report.converged) << report.reason;
  EXPECT_GE(report.levels.size(), 2U);
  EXPECT_EQ(report.levels.back().level, 0);
  EXPECT_LE(report.relative_residual, scene.tolerance);
  EXPECT_EQ(report.warnings.size(), 1U);
}

TEST(Newton, AFailedStepOfTheLoadLeavesTheResidualOfTheStateThatIsKept) {
  const Lattice lattice = box({8, 4, 4}, {1, 1, 1});
  Scene scene;
  scene.conditions = {fix_ball({-0.5, 1.5, 1.5}, 3), fix_ball({7.5, 1.5, 1.5}, 3)};
  scene.conditions[1].by = {-6, 1, 0};  // to a quarter of the length: this law gets weaker below 0.58 of it
  scene.elasticity = Elasticity::green_lagrange;
  scene.volumetric = Volumetric::full;
  SolveReport report;
  const hexmesh::Result kept = solve_equilibrium(lattice, scene, 0, report);
  EXPECT_FALSE(report.converged);
  EXPECT_GT(report.load_fraction, 0);
  EXPECT_LT(report.load_fraction, 1);
  EXPECT_LE(report.relative_residual, scene.tolerance);
  double largest = 0;
  for (const Vec3& u : kept.conditions.at(1).displacement) largest = std::max(largest, u.norm());
  EXPECT_NEAR(largest, report.load_fraction * scene.conditions[1].by.norm(), 1e-6);
}

TEST(Edges, RotationReachesTheEquilibriumOfAMildPull) {
  const Lattice lattice = box({8, 4, 4}, {1, 1, 1});
  Scene scene;
  scene.rotation = Rotation::edges;
  scene.conditions = {fix_ball({-0.5, 1.5, 1.5}, 3), fix_ball({7.5, 1.5, 1.5}, 3)};
  scene.conditions[1].by = {0, 1, 0};
  SolveReport report, polar;
  solve_equilibrium(lattice, scene, 0, report);
  EXPECT_TRUE(report.converged) << report.reason;
  scene.rotation = Rotation::polar;
  solve_equilibrium(lattice, scene, 0, polar);
  EXPECT_NEAR(report.strain_energy_n_mm, polar.strain_energy_n_mm, 0.1 * polar.strain_energy_n_mm);
}

/// The paper's virtual surface: "barycenters of boundary voxels at the scanner's resolution", each bound to the cell
/// that holds it by trilinear weights.
TEST(Supports, VoxelsAreTheCentresOfThoseThatBorderOnNothing) {
  const Lattice lattice = bitten_ball({1, 1.5, 0.8}, {1, 0, 2}, random_rotation(4));
  const hexmesh::Grid& voxels = lattice.voxels;
  const auto has_material = [&](const Index3& v) {
    return voxels.contains(v) && lattice.labels[voxels.offset(v)] != 0;
  };
  std::vector<Vec3> expected;
  for (std::size_t n = 0; n < lattice.labels.size(); ++n) {
    const Index3 v = voxels.index(n);
    if (!has_material(v)) continue;
    bool is_boundary = false;
    for (std::size_t d = 0; d < 3; ++d)
      for (const int side : {-1, 1}) {
        Index3 beside = v;
        beside[d] += side;
        is_boundary = is_boundary || !has_material(beside);
      }
    if (is_boundary) expected.push_back(voxels.position(Vec3(v[0], v[1], v[2])));
  }
  ASSERT_GT(expected.size(), 100U);
  Selection everywhere;
  everywhere.on = SurfacePoints::voxels;
  everywhere.halfspace = HalfSpace{Vec3(0, 0, -1e4), Vec3::UnitZ()};
  for (const int level : {0, 1, 2}) {
    const Body body(lattice, level, Elasticity::cauchy);
    Selector selector({lattice, level}, body.mesh);
    std::vector<Vec3> found;
    for (const SurfacePoint& p : selector.select(everywhere, "test")) {
      EXPECT_NEAR(p.weights.sum(), 1, 1e-12);
      EXPECT_GE(p.weights.minCoeff(), 0) << "inside its cell";
      EXPECT_EQ(p.area, Vec3(0, 0, 0));
      found.push_back(body.mesh.rest_position(p.cell, p.weights));
    }
    ASSERT_EQ(found.size(), expected.size()) << "each once, on every level";
    const auto before = [](const Vec3& a, const Vec3& b) {
      for (int d = 0; d < 3; ++d)
        if (std::abs(a[d] - b[d]) > 1e-6) return a[d] < b[d];
      return false;
    };
    std::vector<Vec3> sorted = expected;
    std::sort(found.begin(), found.end(), before);
    std::sort(sorted.begin(), sorted.end(), before);
    for (std::size_t n = 0; n < found.size(); ++n) ASSERT_LT((found[n] - sorted[n]).norm(), 1e-9);
  }
}

}  // namespace test_supports
