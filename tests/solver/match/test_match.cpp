// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <random>

#include "hexmesh/geometry/surface_tree.h"
#include "hexsolver/equilibrium/equilibrium.h"
#include "match/landmark_matching.h"
#include "match/noise.h"
#include "match/rigid_alignment.h"
#include "match/surface_matching.h"
#include "support/targets.h"
#include "terms/match_term.h"

namespace test_match {

using namespace hexsolver;
using namespace testing_support;
using Eigen::Isometry3d;
using hexmesh::TriangleSurface;

TEST(SurfaceTree, FindsWhatALoopOverAllTrianglesFinds) {
  const TriangleSurface surface = moved(surface_of(crooked_body()), bent);
  const hexmesh::SurfaceTree tree(surface.points, surface.triangles);
  const NodeVector places = noise(600, 40, 3);
  for (Eigen::Index n = 0; n < 200; ++n) {
    const Vec3 place = places.segment<3>(3 * n);
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t t = 0; t < surface.triangles.size(); ++t)
      least = std::min(least, hexmesh::nearest_in(tree.corners(t), place).distance);
    const hexmesh::Foot foot = tree.nearest(place);
    EXPECT_EQ(foot.distance, least);
    const hexmesh::Triangle c = tree.corners(foot.triangle);
    EXPECT_LT((foot.weights[0] * c[0] + foot.weights[1] * c[1] + foot.weights[2] * c[2] - foot.place).norm(), 1e-12);
  }
}

TEST(SurfaceTree, FeetAreOnFacesEdgesAndCorners) {
  const hexmesh::Triangle t = {Vec3(0, 0, 0), Vec3(4, 0, 0), Vec3(0, 4, 0)};
  EXPECT_LT((hexmesh::nearest_in(t, {1, 1, 5}).place - Vec3(1, 1, 0)).norm(), 1e-15);
  EXPECT_LT((hexmesh::nearest_in(t, {1, -3, 5}).place - Vec3(1, 0, 0)).norm(), 1e-15);
  EXPECT_LT((hexmesh::nearest_in(t, {-1, 2, -5}).place - Vec3(0, 2, 0)).norm(), 1e-15);
  EXPECT_LT((hexmesh::nearest_in(t, {3, 3, 0}).place - Vec3(2, 2, 0)).norm(), 1e-15);
  EXPECT_LT((hexmesh::nearest_in(t, {-1, -1, 1}).place - Vec3(0, 0, 0)).norm(), 1e-15);
  EXPECT_LT((hexmesh::nearest_in(t, {9, -1, 1}).place - Vec3(4, 0, 0)).norm(), 1e-15);
  EXPECT_LT((hexmesh::nearest_in(t, {-1, 9, 1}).place - Vec3(0, 4, 0)).norm(), 1e-15);
  for (const hexmesh::Triangle& flat : {hexmesh::Triangle{t[0], t[0], t[0]}, hexmesh::Triangle{t[0], t[0], t[1]}})
    EXPECT_TRUE(std::isfinite(hexmesh::nearest_in(flat, {1, 2, 3}).distance)) << "without an area";
}

class Pulls : public testing::TestWithParam<std::tuple<bool, double, bool>> {
protected:
  const Lattice lattice = crooked_body();
  Match match = match_to(moved(lattice.surface, bent));
  std::vector<Vec3> places = lattice.surface.points;
  const bool lets_go = std::get<2>(GetParam());

  Pulls() {
    match.is_partial = std::get<0>(GetParam());
    match.outliers = std::get<1>(GetParam());
    const NodeVector off = noise(3 * places.size(), 0.3, 7);
    for (std::size_t n = 0; n < places.size(); ++n) places[n] += off.segment<3>(3 * static_cast<Eigen::Index>(n));
  }
  std::vector<Vec3> along(const NodeVector& direction, double length) const {
    std::vector<Vec3> out = places;
    for (std::size_t n = 0; n < out.size(); ++n)
      out[n] += length * direction.segment<3>(3 * static_cast<Eigen::Index>(n));
    return out;
  }
};

TEST_P(Pulls, ForcesAreDerivativesOfTheEnergyWhichSpringsBound) {
  const SurfaceMatching matching(match, lattice.surface, 0.01, size_of(lattice));
  Pull here, there;
  matching.pull(places, Isometry3d::Identity(), lets_go, here);
  for (unsigned seed = 1; seed < 6; ++seed) {
    const NodeVector direction = noise(3 * places.size(), 1, seed);
    constexpr double h = 1e-6;
    matching.pull(along(direction, h), Isometry3d::Identity(), lets_go, there);
    double after = there.energy;
    matching.pull(along(direction, -h), Isometry3d::Identity(), lets_go, there);
    const double measured = (after - there.energy) / (2 * h);
    double claimed = 0, size = 0;
    for (std::size_t n = 0; n < places.size(); ++n) {
      const Vec3 d = direction.segment<3>(3 * static_cast<Eigen::Index>(n));
      claimed += here.gradient[n].dot(d);
      size += here.gradient[n].norm() * d.norm();
    }
    EXPECT_NEAR(measured, claimed, 1e-6 * size);
    for (const double length : {0.01, 0.3, 3.0}) {
      matching.pull(along(direction, length), Isometry3d::Identity(), lets_go, there);
      double bound = here.energy;
      for (std::size_t n = 0; n < places.size(); ++n) {
        const Vec3 d = length * direction.segment<3>(3 * static_cast<Eigen::Index>(n));
        bound += d.dot(here.gradient[n]) + here.bound[n] / 2 * d.squaredNorm();
      }
      EXPECT_LE(there.energy, bound * (1 + 1e-12));
    }
  }
  for (std::size_t n = 0; n < places.size(); ++n) {
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(here.hessian[n]);
    EXPECT_GE(eigen.eigenvalues()[0], -1e-12 * here.bound[n]);
    EXPECT_LE(eigen.eigenvalues()[2], (1 + 1e-12) * here.bound[n]);
  }
}

INSTANTIATE_TEST_SUITE_P(OfAWholeAndOfAPart, Pulls,
                         testing::Combine(testing::Bool(), testing::Values(0.0, 0.2), testing::Bool()));

/// A point above a face is held across it and slides along it.
TEST(SurfaceMatching, PointsSlideAlongFaces) {
  TriangleSurface plate, body;
  plate.points = {{-0.6, -0.6, 0}, {0.6, -0.6, 0}, {0, 0.6, 0}};
  plate.triangles = {{0, 1, 2}};
  body.points = {{-0.2, 0, 1}, {0.2, 0, 1}, {0, 0.2, 1}};
  body.triangles = {{0, 1, 2}};
  Match match = match_to(plate);
  match.is_partial = false;
  const SurfaceMatching matching(match, body, 2, 20);
  Pull pull;
  matching.pull(body.points, Isometry3d::Identity(), false, pull);
  const double area = 0.04 / 3;  // of each point; the target's points are nearest to edges and corners of the body
  for (const Vec3& g : pull.gradient) EXPECT_GT(g[2], 0.99 * area) << "half of the stiffness, 1 mm";
  EXPECT_NEAR(matching.distances(body.points).body_to_target->mean_mm, 1, 1e-12);
}

TEST(Alignment, FindsTheMotionOfABodyThatIsTurnedAndShifted) {
  Lattice lattice = crooked_body();
  const Isometry3d motions[] = {turned(25, {1, 2, 3}, {5, -4, 3}), turned(80, {-1, 0.4, 1}, {200, 0, -90}),
                                turned(180, {1, 0, 0.2}, {0, 30, 0})};
  for (const Isometry3d& motion : motions) {
    Scene scene;
    scene.matches = {match_to(moved(lattice.surface, [&](const Vec3& p) -> Vec3 { return motion * p; }))};
    const Isometry3d found = align(make_matchings(scene, lattice));
    for (const Vec3& p : lattice.surface.points) ASSERT_LT((found * p - motion * p).norm(), 0.02);
  }
}

TEST(Matching, ABodyOnItselfStaysAndATurnedOneTurns) {
  const Lattice lattice = crooked_body();
  for (const bool is_turned : {false, true}) {
    const Isometry3d motion = is_turned ? turned(50, {1, -1, 2}, {10, 20, -5}) : Isometry3d::Identity();
    Scene scene;
    scene.elasticity = Elasticity::neo_hookean;
    scene.matches = {match_to(moved(lattice.surface, [&](const Vec3& p) -> Vec3 { return motion * p; }))};
    const Outcome outcome = solve_equilibrium(lattice, scene, 0);
    ASSERT_TRUE(outcome.report.converged) << outcome.report.reason;
    for (std::size_t n = 0; n < outcome.result.nodes.size(); ++n) {
      const Vec3& x = outcome.result.nodes[n];
      ASSERT_LT((outcome.result.displacement[n] - (motion * x - x)).norm(), is_turned ? 1e-4 : 1e-9);
    }
    EXPECT_LT(outcome.report.matches.at(0).distance.largest_mm, is_turned ? 1e-4 : 1e-9);
  }
}

/// At the end, attached anew, what pulls and the cells' forces balance: what was found is where the energy is least.
TEST(Matching, ABentTargetIsMetAndForcesBalance) {
  const Lattice lattice = crooked_body();
  double before = 0;
  for (const double trust : {2.0, 0.2, 0.02}) {
    Scene scene;
    scene.elasticity = Elasticity::corotational;
    scene.matches = {match_to(moved(lattice.surface, bent))};
    scene.matches[0].trust = trust;
    const Outcome outcome = solve_equilibrium(lattice, scene, 0);
    ASSERT_TRUE(outcome.report.converged) << outcome.report.reason;
    const MatchReport& match = outcome.report.matches.at(0);
    EXPECT_LT(match.distance.mean_mm, match.at_start.mean_mm);
    EXPECT_TRUE(before == 0 || match.distance.mean_mm < 0.5 * before) << "ten times the stiffness";
    before = match.distance.mean_mm;
    // Nothing else acts: the pulls have no resultant but what the last round leaves.
    EXPECT_LT(match.force_n.norm(), 1e-2 * outcome.report.strain_energy_n_mm / match.distance.mean_mm);
    EXPECT_LT(outcome.report.balance.sum().force_n.norm(), 1e-9);
  }
  EXPECT_LT(before, 0.02);
}

TEST(Matching, LandmarksPullTheirPointsAndNothingElseIsNeeded) {
  Lattice lattice = crooked_body();
  Scene scene;
  scene.elasticity = Elasticity::corotational;
  Match landmarks;
  landmarks.name = landmarks.where = "landmarks";
  for (const std::size_t n : {0U, 40U, 90U, 150U, 200U}) {
    landmarks.from.push_back(lattice.surface.points[n]);
    landmarks.to.push_back(bent(lattice.surface.points[n]));
  }
  landmarks.trust = 1e-3;
  scene.matches = {landmarks};
  const Outcome outcome = solve_equilibrium(lattice, scene, 0);
  ASSERT_TRUE(outcome.report.converged) << outcome.report.reason;
  EXPECT_LT(outcome.report.matches.at(0).distance.largest_mm, 0.02);
  scene.matches[0].from[0] += Vec3(500, 0, 0);
  EXPECT_THROW(solve_equilibrium(lattice, scene, 0), hexmesh::Error) << "a landmark in no cell";
}

TEST(Noise, IsFoundOnCurvedSurfacesAndNotInvented) {
  constexpr int around = 120, up = 60;
  TriangleSurface ball;
  for (int v = 0; v <= up; ++v)
    for (int n = 0; n < around; ++n) {
      const double a = 2 * std::acos(-1.0) * (n + v / 2.0) / around, b = std::acos(-1.0) * (0.1 + 0.8 * v / up);
      ball.points.emplace_back(50 * std::sin(b) * std::cos(a), 70 * std::sin(b) * std::sin(a), 40 * std::cos(b));
    }
  for (int v = 0; v < up; ++v)
    for (int n = 0; n < around; ++n) {
      const int a = v * around + n, b = v * around + (n + 1) % around;
      ball.triangles.push_back({a, b, a + around});
      ball.triangles.push_back({b, b + around, a + around});
    }
  EXPECT_LT(noise_of(ball), 0.002);
  for (const double sigma : {0.1, 0.5}) {  // of 7,000 points the median is known to 2 %
    std::mt19937 random(5);
    std::normal_distribution<double> normal(0, sigma);
    TriangleSurface rough = ball;
    for (Vec3& p : rough.points) p += Vec3(normal(random), normal(random), normal(random));
    EXPECT_NEAR(noise_of(rough), sigma, 0.1 * sigma);
  }
}

/// Cells with little material bear little: what noise would fold is pulled less, and the rest as before.
TEST(Matching, NoiseFoldsNoVoxels) {
  const Lattice lattice = crooked_body();
  Scene scene;
  scene.elasticity = Elasticity::neo_hookean;
  const NodeVector off = noise(3 * lattice.surface.points.size(), 1.5, 9);
  std::size_t n = 0;
  scene.matches = {match_to(moved(lattice.surface, [&](const Vec3& p) -> Vec3 {
    return bent(p) + off.segment<3>(3 * static_cast<Eigen::Index>(n++));
  }))};
  scene.matches[0].trust = 0.1;
  const Outcome outcome = solve_equilibrium(lattice, scene, 0);
  ASSERT_EQ(outcome.report.load_fraction, 1) << outcome.report.reason;
  EXPECT_EQ(outcome.report.inverted_voxels, 0U) << outcome.report.min_jacobian;
  const MatchReport& match = outcome.report.matches.at(0);
  EXPECT_GT(match.eased_points, 0U);
  EXPECT_LT(match.eased_points, lattice.surface.points.size());
  EXPECT_EQ(match.trust_mm, 0.1);
}

/// From a solution of other material rounds end where they end from rest.
TEST(Matching, AStartSavesRoundsAndChangesNothing) {
  const Lattice lattice = crooked_body();
  Scene scene;
  scene.elasticity = Elasticity::corotational;
  scene.matches = {match_to(moved(lattice.surface, bent))};
  const Outcome from_rest = solve_equilibrium(lattice, scene, 0),
                of_other = solve_equilibrium(crooked_body(0.3), scene, 0),
                from_other = solve_equilibrium(lattice, scene, 0, {}, &of_other.result.displacement);
  ASSERT_TRUE(from_other.report.converged) << from_other.report.reason;
  EXPECT_EQ(from_other.report.levels.size(), 1U);
  const auto apart = [&](const Outcome& a, const Outcome& b) {
    double sum = 0;
    for (std::size_t n = 0; n < lattice.surface.points.size(); ++n)
      sum += (a.result.surface_displacement[n] - b.result.surface_displacement[n]).norm();
    return sum / static_cast<double>(lattice.surface.points.size());
  };
  double size = 0;
  for (const Vec3& u : from_rest.result.surface_displacement)
    size += u.norm() / static_cast<double>(lattice.surface.points.size());
  EXPECT_LT(apart(from_other, from_rest), 5e-3 * size) << "rounds rest at a thousandth";
  EXPECT_LT(apart(from_other, from_rest), 0.5 * apart(of_other, from_rest)) << "another solution";
}

/// The start is of the level asked, not of the one that is looked at for its error.
TEST(Matching, AStartIsNotOfTheLevelThatIsLookedAt) {
  const Lattice lattice = crooked_body();
  Scene scene;
  scene.elasticity = Elasticity::corotational;
  scene.matches = {match_to(moved(lattice.surface, bent))};
  scene.error_estimation = ErrorEstimation::look;
  const Outcome first = solve_equilibrium(lattice, scene, 1),
                again = solve_equilibrium(lattice, scene, 1, {}, &first.result.displacement);
  ASSERT_TRUE(again.report.converged) << again.report.reason;
  EXPECT_TRUE(again.report.levels.back().error.mean_mm) << "from the look";
}

/// What is not seen stays where the rigid motion puts it, however little is seen.
TEST(Matching, APartOfTheBodyItselfMovesNothing) {
  const Lattice lattice = crooked_body();
  for (const double limit : {5.0, 20.0, 29.0}) {
    TriangleSurface part = lattice.surface;
    std::erase_if(part.triangles, [&](const auto& t) {
      return std::any_of(t.begin(), t.end(),
                         [&](std::int32_t n) { return part.points[hexmesh::as_size(n)][0] < limit; });
    });
    ASSERT_FALSE(part.triangles.empty());
    Scene scene;
    scene.elasticity = Elasticity::neo_hookean;
    scene.matches = {match_to(part)};
    const Outcome outcome = solve_equilibrium(lattice, scene, 1);
    ASSERT_TRUE(outcome.report.converged) << outcome.report.reason;
    for (const Vec3& u : outcome.result.displacement) ASSERT_LT(u.norm(), 1e-6) << limit;
  }
}

TEST(Matching, GoesWithCellsAlikeAndContactsThatAreMetOnTheWay) {
  const Lattice lattice = crooked_body();
  Scene scene;
  scene.elasticity = Elasticity::corotational;
  const Vec3 shift(3000, 0, 0);
  scene.matches = {match_to(moved(lattice.surface, [&](const Vec3& p) -> Vec3 { return p + shift; }))};
  scene.contacts = {{"ball", "test", Ball{Vec3(8, 5, 5), 12}, Vec3::Zero(), 0.1}};
  EXPECT_TRUE(solve_equilibrium(lattice, scene, 1).report.converged) << "it is where the body was";
  scene.contacts[0].obstacle = Ball{Vec3(3008, 5, 5), 12};
  EXPECT_THROW(solve_equilibrium(lattice, scene, 1), hexmesh::Error) << "it is in the body";
  scene.contacts.clear();
  scene.grading = Grading::scene;
  EXPECT_THROW(check_matches(scene), hexmesh::Error);
}

}  // namespace test_match
