// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "hexsolver/equilibrium/equilibrium.h"
#include "match/rigid_alignment.h"
#include "match/surface_matching.h"
#include "support/targets.h"

namespace test_outliers {

using namespace hexsolver;
using namespace testing_support;
using Eigen::Isometry3d;
using hexmesh::TriangleSurface;

/// A tetrahedron beside a target.
void add_piece(TriangleSurface& target, const Vec3& at, double edge) {
  const auto first = static_cast<std::int32_t>(target.points.size());
  for (const Vec3& p : {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)})
    target.points.push_back(at + edge * p);
  for (const auto& t : {std::array{0, 2, 1}, std::array{0, 1, 3}, std::array{0, 3, 2}, std::array{1, 2, 3}})
    target.triangles.push_back({first + t[0], first + t[1], first + t[2]});
}

Scene scene_of(TriangleSurface target, Elasticity elasticity = Elasticity::neo_hookean) {
  Scene scene;
  scene.elasticity = elasticity;
  scene.matches = {match_to(std::move(target))};
  scene.matches[0].trust = 0.1;
  return scene;
}

double mean_apart(const Outcome& a, const Outcome& b) {
  double sum = 0;
  for (std::size_t n = 0; n < a.result.nodes.size(); ++n)
    sum += (a.result.displacement[n] - b.result.displacement[n]).norm();
  return sum / static_cast<double>(a.result.nodes.size());
}

/// A point drawn out of the surface, and pieces of something else with a fifth of the area: let go of, told, and the
/// fit is the one without.
TEST(Outliers, SpikesAndPiecesAreLetGo) {
  const Lattice lattice = crooked_body();
  const TriangleSurface clean = moved(lattice.surface, bent);
  const Outcome without = solve_equilibrium(lattice, scene_of(clean), 1);
  ASSERT_TRUE(without.report.converged) << without.report.reason;
  EXPECT_EQ(without.report.matches.at(0).left_out, 0);
  TriangleSurface spiked = clean, beside = clean;
  spiked.points[100] += Vec3(0, 0, 120);
  add_piece(beside, {0, 45, 0}, 20);
  for (const TriangleSurface& target : {spiked, beside}) {
    const Outcome with = solve_equilibrium(lattice, scene_of(target), 1);
    ASSERT_TRUE(with.report.converged) << with.report.reason;
    EXPECT_GT(with.report.matches.at(0).left_out, 1e-3);
    EXPECT_LT(mean_apart(with, without), 0.05);
    EXPECT_FALSE(with.report.warnings.empty());
    Scene all = scene_of(target);
    all.matches[0].outliers = 0;
    const Outcome pulled = solve_equilibrium(lattice, all, 1);
    EXPECT_TRUE(!pulled.report.converged || mean_apart(pulled, without) > 0.5) << "outliers_mm = 0";
  }
}

/// What the body can follow is not let go, however far it is at first.
TEST(Outliers, ALobeThatMovesFarIsFollowed) {
  const Lattice lattice = crooked_body();
  const TriangleSurface target = moved(lattice.surface, [](const Vec3& p) -> Vec3 {
    const double beyond = std::max(0.0, p[0] - 16);
    return {p[0], p[1] + 0.06 * beyond * beyond, p[2]};
  });
  const Outcome outcome = solve_equilibrium(lattice, scene_of(target), 0);
  ASSERT_TRUE(outcome.report.converged) << outcome.report.reason;
  const MatchReport& match = outcome.report.matches.at(0);
  EXPECT_GT(match.at_start.largest_mm, 3);
  EXPECT_EQ(match.left_out, 0);
  EXPECT_LT(match.distance.mean_mm, 0.15 * match.at_start.mean_mm);
}

TEST(Outliers, MostOfTheTargetSaysWhereTheBodyIs) {
  const Lattice lattice = crooked_body();
  TriangleSurface target = lattice.surface;
  add_piece(target, {0, 40, 0}, 20);
  const Isometry3d pose = align(make_matchings(scene_of(target), lattice));
  for (const Vec3& p : lattice.surface.points) ASSERT_LT((pose * p - p).norm(), 1e-3);
}

TEST(Outliers, APartIsFoundHoweverItIsTurned) {
  const Lattice lattice = crooked_body();
  for (const Isometry3d& motion : {turned(180, {0, 0, 1}, {5, 30, -9}), turned(90, {0, 1, 0}, {60, 0, 0})}) {
    TriangleSurface part = moved(lattice.surface, [&](const Vec3& p) -> Vec3 { return motion * p; });
    std::erase_if(part.triangles, [&](const auto& t) { return lattice.surface.points[hexmesh::as_size(t[0])][2] < 7; });
    const Isometry3d found = align(make_matchings(scene_of(part), lattice));
    for (const Vec3& p : lattice.surface.points) ASSERT_LT((found * p - motion * p).norm(), 0.05);
  }
}

TEST(Outliers, SoupIsTheSurfaceThatItIsOf) {
  const Lattice lattice = crooked_body();
  TriangleSurface soup;
  for (const auto& t : lattice.surface.triangles) {
    const auto first = static_cast<std::int32_t>(soup.points.size());
    for (const std::int32_t n : t) soup.points.push_back(lattice.surface.points[hexmesh::as_size(n)]);
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  soup.triangles.push_back(soup.triangles.front());
  soup.triangles.push_back({0, 0, 1});
  std::swap(soup.triangles[7][0], soup.triangles[7][1]);
  const Matchings matchings = make_matchings(scene_of(soup), lattice);
  EXPECT_TRUE(matchings.at(0)->is_whole());
  EXPECT_EQ(matchings.at(0)->distances(lattice.surface.points).points, lattice.surface.points.size());
}

TEST(Outliers, TargetsInOtherUnitsAreRefusedAtOnce) {
  const Lattice lattice = crooked_body();
  for (const double factor : {1e-3, 0.1, 10.0, 1000.0})
    EXPECT_THROW(
        make_matchings(scene_of(moved(lattice.surface, [&](const Vec3& p) -> Vec3 { return factor * p; })), lattice),
        hexmesh::Error)
        << factor;
}

/// Landmarks that are mirrored, or two that are exchanged, are no landmarks of this body.
TEST(Outliers, LandmarksThatContradictAreNoSolution) {
  const Lattice lattice = crooked_body();
  Match landmarks;
  landmarks.name = landmarks.where = "landmarks";
  landmarks.from = {{0, 0, 0}, {30, 0, 0}, {0, 18, 0}, {0, 0, 14}, {8, 18, 14}, {20, 8, 14}};
  const auto solve = [&](const std::vector<Vec3>& to, std::size_t count) {
    Scene scene;
    scene.elasticity = Elasticity::neo_hookean;
    scene.matches = {landmarks};
    scene.matches[0].to = to;
    scene.matches[0].from.resize(count);
    scene.matches[0].to.resize(count);
    return solve_equilibrium(lattice, scene, 1);
  };
  std::vector<Vec3> swapped = landmarks.from, mirrored;
  std::swap(swapped[0], swapped[4]);
  for (const Vec3& p : landmarks.from) mirrored.emplace_back(-p[0], p[1], p[2]);
  EXPECT_TRUE(solve(landmarks.from, 6).report.converged);
  EXPECT_FALSE(solve(swapped, 6).report.converged);
  EXPECT_FALSE(solve(mirrored, 6).report.converged);
  for (const std::size_t few : {1U, 2U}) EXPECT_THROW(solve(landmarks.from, few), hexmesh::Error) << few;
}

TEST(Outliers, ATargetThatIsNotThisBodyIsNoSolution) {
  const Lattice lattice = crooked_body();
  Scene scene;
  scene.elasticity = Elasticity::neo_hookean;
  scene.matches = {match_to(moved(lattice.surface, [](const Vec3& p) -> Vec3 {
    return {0.2 * p[0], 4 * p[1], p[2]};
  }))};
  scene.matches[0].trust = 5;
  const Outcome outcome = solve_equilibrium(lattice, scene, 1);
  EXPECT_FALSE(outcome.report.converged);
  EXPECT_NE(outcome.report.reason.find("off in the mean"), std::string::npos) << outcome.report.reason;
}

}  // namespace test_outliers
