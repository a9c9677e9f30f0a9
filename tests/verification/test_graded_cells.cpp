// SPDX-License-Identifier: Apache-2.0
// What smaller cells at the supports save, and that all that a scene may ask for works on them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "hexsolver/scene/scene_files.h"
#include "level/grading.h"
#include "support/bodies.h"
#include "support/experiments.h"

namespace test_graded_cells {

using namespace hexsolver;
using namespace testing_support;

Scene graded(Scene scene, int coarser_by = 2) {
  scene.grading = Grading::scene;
  scene.coarser_by = coarser_by;
  return scene;
}

std::size_t cells_of(const Lattice& lattice, const Scene& scene) { return cells_for(lattice, scene, 0).size(); }

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return (values[(values.size() - 1) / 2] + values[values.size() / 2]) / 2;
}

/// The phantom's pull on several positions of the lattice against the body.
struct Positions {
  std::vector<double> error, dofs;  ///< against level 0 [mm]
};

const std::vector<hexmesh::Index3> some_positions{{0, 0, 0}, {15, 16, 24}, {30, 1, 4}, {8, 19, 11}};

/// @param choose  the scene as it is solved
template <class Choose>
Positions pull(int level, const Choose& choose, const std::vector<hexmesh::Index3>& positions = some_positions) {
  Positions out;
  for (const hexmesh::Index3& offset : positions) {
    const Lattice lattice = liver_of_phantom(2, 0.3, offset);
    const Scene scene = with(phantom_patches(10));
    const std::vector<Vec3> points = material_points(lattice);
    const std::vector<Vec3> exact = displacement_at(solve(lattice, scene, 0).result, points);
    const Solved solved = solve(lattice, choose(scene), level);
    out.error.push_back(distance(displacement_at(solved.result, points), exact).mean);
    out.dofs.push_back(static_cast<double>(3 * solved.report.levels.back().nodes));
  }
  return out;
}

TEST(GradedCells, TakeAQuarterOfTheUnknownsForAnError) {
  const auto by_scene = [](const Scene& scene) { return graded(scene); };
  const auto alike = [](const Scene& scene) { return scene; };
  const Positions coarse = pull(2, by_scene), fine = pull(1, by_scene), uniform = pull(2, alike);
  printf("graded: %.3f mm with %.0f unknowns, %.3f mm with %.0f; uniform: %.3f mm with %.0f\n", median(coarse.error),
         median(coarse.dofs), median(fine.error), median(fine.dofs), median(uniform.error), median(uniform.dofs));
  EXPECT_LT(median(coarse.error), 0.30);
  EXPECT_LT(median(coarse.dofs), 1200);
  EXPECT_LT(median(fine.error), 0.12);
  EXPECT_LT(median(fine.dofs), 3100);
  EXPECT_LT(median(fine.error), median(uniform.error));
  EXPECT_LT(3 * median(fine.dofs), 1.5 * median(uniform.dofs));
}

TEST(GradedCells, AnAccuracyTakesFewUnknowns) {
  std::vector<hexmesh::Index3> positions = some_positions;
  positions.insert(positions.end(), {{26, 30, 7}, {21, 5, 29}, {3, 13, 18}, {17, 26, 13}});
  const auto accurate = [](const Scene& scene) {
    Scene of = graded(scene);
    of.accuracy = 0.15;
    return of;
  };
  const Positions found = pull(0, accurate, positions);
  printf("%.3f mm with %.0f unknowns\n", median(found.error), median(found.dofs));
  EXPECT_LT(median(found.error), 0.06);
  EXPECT_LT(median(found.dofs), 5000);
}

/// Where graded cells are so many that they are not worth while, cells alike go on: never with fewer.
TEST(GradedCells, GiveWayToCellsAlike) {
  const Lattice lattice = liver_of_phantom(2, 0.3);
  Scene alike = with(phantom_patches(10));
  alike.accuracy = 1e-3;
  const Solved voxels = solve(lattice, alike, 0);
  for (const double asked : {1e-3, 0.06}) {
    Scene scene = graded(alike);
    scene.accuracy = asked;
    const Solved solved = solve(lattice, scene, 0);
    const std::vector<LevelReport>& levels = solved.report.levels;
    std::size_t most_graded = 0, first_alike = 0;
    for (std::size_t l = 1; l < levels.size() && first_alike == 0; ++l) {
      if (levels[l].level > levels[l - 1].level)
        first_alike = l;
      else
        most_graded = levels[l].cells;
    }
    ASSERT_GT(first_alike, 0U) << "no cells alike took over";
    EXPECT_GE(levels.back().cells, most_graded);
    EXPECT_EQ(levels.back().cells, lattice.levels[hexmesh::as_size(levels.back().level)].cells.size());
    if (asked == 1e-3) {
      EXPECT_LT(distance(solved.result.displacement, voxels.result.displacement).largest, 1e-4);
    }
  }
}

/// A ball that stands on its tip tumbles with some graded cells, and is 68 mm off where its cells agree to 0.02.
TEST(GradedCells, DoNotEndInAnotherEquilibrium) {
  const Lattice lattice = lattice_of(
      make_volume(
          {32, 32, 32}, {2.5, 2.5, 2.5},
          [](const hexmesh::Index3& v) { return Vec3(v[0] - 15.5, v[1] - 15.5, v[2] - 15.5).norm() < 16 ? 1 : 0; }),
      100, 0.3);
  Scene scene = parse_scene(
      "[solve]\ngrading = \"scene\"\nstrain = \"corotational\"\naccuracy_mm = 0.0566813\n"
      "[[fix]]\nname = \"end\"\nhalfspace = { point_mm = [38.75, 38.75, 3.55], normal = [0, 0, -1] }\n"
      "[[force]]\nname = \"patch\"\npoint_mm = [38.75, 38.75, 78.75]\nradius_mm = 28\nmax_distance_mm = 20\n"
      "pressure_kpa = 4.72276\n",
      "test", "");
  const Outcome found = solve_equilibrium(lattice, scene, 0);
  EXPECT_TRUE(found.report.converged && !found.report.accuracy_missed) << found.report.reason;
  scene.accuracy.reset();
  scene.grading = Grading::off;
  const std::vector<Vec3> points = material_points(lattice);
  const double error =
      distance(displacement_at(found.result, points), displacement_at(solve(lattice, scene, 0).result, points)).mean;
  EXPECT_LE(error, 1.2 * 0.0566813);
}

/// Across a fissure, straight and oblique, whose end lies in large cells unless they are divided there.
TEST(GradedCells, AreSmallWhereGapsEnd) {
  for (const int slope : {0, 1})
    for (const hexmesh::Index3& offset : {hexmesh::Index3{0, 0, 0}, {5, 3, 6}}) {
      const auto fissured = [slope](const hexmesh::Index3& v) {
        return v[0] + slope * v[1] == 40 && v[1] > 15 ? 0 : 1;
      };
      const Lattice lattice = lattice_of(make_volume({80, 40, 24}, {1, 1, 1}, fissured), 100, 0.3, {0, offset});
      const Scene scene = with(
          {beyond("left", {0, 0, 0}, {-1, 0, 0}, Vec3::Zero()), beyond("right", {79, 0, 0}, {1, 0, 0}, {4, 0, 0})});
      const auto opening = [&](const Scene& s, int level) {
        const hexmesh::Result result = solve(lattice, s, level).result;
        const std::vector<Vec3> u =
            displacement_at(result, {Vec3(36 - slope * 38, 38, 12), Vec3(44 - slope * 38, 38, 12)});
        return (u[1] - u[0])[0];
      };
      const double expected = opening(scene, 0), of_graded = opening(graded(scene), 1),
                   of_voxels = opening(graded(scene), 0);
      printf("slope %d: opens by %.3f mm, graded cells by %.3f mm, down to voxels %.3f mm, large ones by %.3f mm\n",
             slope, expected, of_graded, of_voxels, opening(scene, 3));
      EXPECT_NEAR(of_graded, expected, 0.05 * expected);
      EXPECT_NEAR(of_voxels, expected, 0.01 * expected);
    }
}

TEST(GradedCells, OfOneLevelAreThatLevel) {
  const Lattice lattice = liver_of_phantom(4, 0.3);
  const Scene scene = with(phantom_patches(12), Elasticity::corotational);
  const Solved one = solve(lattice, graded(scene, 0), 1), level = solve(lattice, scene, 1);
  EXPECT_EQ(one.result.displacement, level.result.displacement);
}

/// Larger cells than there are change nothing, and no error is told from a look at the same cells.
TEST(GradedCells, CoarserThanThereAreAreNoneBeyond) {
  const Lattice lattice = liver_of_phantom(4, 0.3);
  Scene scene = with(phantom_patches(12));
  scene.error_estimation = ErrorEstimation::automatic;
  const Solved some = solve(lattice, graded(scene, 4), 0), more = solve(lattice, graded(scene, 30), 0);
  EXPECT_EQ(some.result.displacement, more.result.displacement);
  const std::vector<Vec3> points = material_points(lattice);
  const double error =
      distance(displacement_at(more.result, points), displacement_at(solve(lattice, scene, 0).result, points)).mean;
  for (const Solved* s : {&some, &more}) {
    const std::optional<double>& told = s->report.levels.back().error.mean_mm;
    if (!told) continue;  // unknown is no false word
    EXPECT_GT(*told, error / 3);
    EXPECT_LT(*told, 3 * error);
  }
}

TEST(GradedCells, KeepTheAccuracyTheySay) {
  const Lattice lattice = liver_of_phantom(2, 0.3);
  const std::vector<Vec3> points = material_points(lattice);
  Scene pulled = with(phantom_patches(10)), weight = pulled;
  weight.conditions.pop_back();
  weight.gravity = {0, 0, -9810};
  for (const Scene& scene : {pulled, weight}) {
    const std::vector<Vec3> exact = displacement_at(solve(lattice, scene, 0).result, points);
    for (const double asked : {0.5, 0.3, 0.15}) {
      Scene accurate = graded(scene);
      accurate.error_estimation = ErrorEstimation::automatic;
      accurate.accuracy = asked;
      const Outcome outcome = solve_equilibrium(lattice, accurate, 0);
      const double error = distance(displacement_at(outcome.result, points), exact).mean;
      printf("asked %.2f mm, level %d%s, true %.3f mm\n", asked, outcome.result.level,
             outcome.report.accuracy_missed ? ", told to be missed" : "", error);
      EXPECT_FALSE(outcome.report.accuracy_missed);
      EXPECT_LE(error, asked);
    }
  }
}

/// A support of so many nodes that these themselves are held holds no less than cells alike do.
TEST(GradedCells, LargeSupportsHoldTheirRims) {
  const Lattice lattice = liver_of_phantom(2, 0.3);
  Scene scene = with({beyond("held", {-40, 0, 0}, {-1, 0, 0}, Vec3::Zero())});
  scene.gravity = {0, 0, -9810};
  const double fine = solve(lattice, scene, 0).report.strain_energy_n_mm,
               of_graded = solve(lattice, graded(scene), 0).report.strain_energy_n_mm;
  printf("energy with cells alike %.4g N mm, graded %.4g N mm\n", fine, of_graded);
  EXPECT_NEAR(of_graded, fine, 0.05 * fine);
}

TEST(GradedCells, AreSmallOnTheWayOfAnObstacle) {
  const Lattice lattice = liver_of_phantom(4, 0.3);
  Scene scene = with({phantom_patches(12)[0]});
  Contact ball;
  ball.name = ball.where = "ball";
  ball.obstacle = Ball{{20, -90, 0}, 20};
  ball.stiffness = 0.05;
  scene.contacts = {ball};
  const auto cells = [&] { return cells_of(lattice, graded(scene)); };
  const std::size_t still = cells();
  scene.contacts[0].by = {0, 40, 0};
  const std::size_t moved = cells();
  scene.contacts[0].by = Vec3::Zero();
  scene.contacts[0].history = History{{{0, Vec3::Zero()}, {1, {0, 40, 0}}, {2, Vec3::Zero()}}};
  EXPECT_GT(moved, still + 100);
  EXPECT_EQ(cells(), moved);
}

/// Linear iterations of the last level.
int iterations(const Lattice& lattice, const Scene& scene, int level) {
  return solve(lattice, scene, level).report.levels.back().newton.linear_iterations;
}

/// Also of cells that are condensed and softly held, graded (by default) or not.
class GradedIterations : public testing::TestWithParam<double> {};

TEST_P(GradedIterations, AreThoseOfCellsAlike) {
  std::vector<std::pair<Lattice, Scene>> bodies;
  bodies.emplace_back(liver_of_phantom(2, GetParam()), with(phantom_patches(10)));
  if (has_scan()) bodies.emplace_back(liver_of_scan(GetParam()), with(liver_patches(12, SurfacePoints::faces)));
  for (const auto& [lattice, scene] : bodies)
    for (const int level : {1, 0}) {
      Scene soft = scene;
      soft.stiffness = Stiffness::condensed;
      const int of_graded = iterations(lattice, graded(scene), level), of_alike = iterations(lattice, scene, level),
                of_soft = iterations(lattice, soft, level);
      printf("level %d: %d iterations graded, %d alike, %d condensed and softly held\n", level, of_graded, of_alike,
             of_soft);
      EXPECT_LE(of_graded, 1.3 * of_alike);
      EXPECT_LE(of_soft, 1.3 * of_alike);
    }
}

INSTANTIATE_TEST_SUITE_P(PoissonRatios, GradedIterations, testing::Values(0.3, 0.49));

/// Scenes of every kind of load.
struct Load {
  const char* name;
  std::function<Scene()> scene;
};
void PrintTo(const Load& l, std::ostream* out) { *out << l.name; }

Scene held_and(const std::function<void(Scene&)>& add, Elasticity elasticity) {
  std::vector<Condition> held = phantom_patches(12);
  held.pop_back();
  Scene scene = with(std::move(held), elasticity);
  add(scene);
  return scene;
}

Force push(const Vec3& total, double pressure) {
  const Condition at = phantom_patches(12).back();
  return {"push", "", at.selection, total, pressure, {}};
}

class GradedLoads : public testing::TestWithParam<Load> {};

/// Forces and moments of all that acts add up to nothing, and solutions come near that of cells alike of the finest
/// size as their larger cells get smaller.
TEST_P(GradedLoads, BalanceAndComeNearFineCells) {
  const Lattice lattice = liver_of_phantom(3, 0.45);
  const Scene scene = GetParam().scene();
  const Solved fine = solve(lattice, scene, 0), of_graded = solve(lattice, graded(scene, 1), 0),
               coarser = solve(lattice, graded(scene, 3), 0);
  Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
  double largest = 0, largest_moment = 0;
  for (const BalanceReport::Row& row : of_graded.report.balance.acting) {
    force += row.force_n;
    moment += row.moment_n_mm;
    largest = std::max(largest, row.force_n.norm());
    largest_moment = std::max(largest_moment, row.moment_n_mm.norm());
  }
  EXPECT_LT(force.norm(), 1e-5 * largest);
  EXPECT_LT(moment.norm(), 1e-4 * largest_moment);
  Vec3 of_contacts = Vec3::Zero(), on_nodes = Vec3::Zero();
  for (const ContactReport& c : of_graded.report.contacts) of_contacts += c.force_n;
  for (const Vec3& f : of_graded.result.contact_force) on_nodes += f;
  EXPECT_EQ(of_graded.result.contact_force.empty(), scene.contacts.empty());
  EXPECT_LE((on_nodes - of_contacts).norm(), 1e-9 * of_contacts.norm());
  const std::vector<Vec3> points = material_points(lattice);
  const std::vector<Vec3> exact = displacement_at(fine.result, points);
  const double error = distance(displacement_at(of_graded.result, points), exact).mean,
               of_coarser = distance(displacement_at(coarser.result, points), exact).mean;
  printf("%s: %.3g mm with %zu cells, %.3g mm with %zu cells\n", GetParam().name, error,
         of_graded.report.levels.back().cells, of_coarser, coarser.report.levels.back().cells);
  EXPECT_LT(error, 0.6 * of_coarser);
  EXPECT_LT(of_graded.report.levels.back().cells, fine.report.levels.back().cells / 4);
  EXPECT_EQ(of_graded.result.cells.size(), fine.result.cells.size());
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, GradedLoads,
    testing::Values(
        Load{"pulled", [] { return with(phantom_patches(12), Elasticity::corotational); }},
        Load{"pulled, neo-Hookean", [] { return with(phantom_patches(12), Elasticity::neo_hookean); }},
        Load{"weight", [] { return held_and(
                                [](Scene& s) {
                                  s.gravity = {0, 9810, 0};
                                },
                                Elasticity::corotational); }},
        Load{"force",
             [] {
               return held_and([](Scene& s) { s.forces = {push({0, -0.2, -0.3}, 0)}; }, Elasticity::corotational);
             }},
        Load{"pressure",
             [] { return held_and([](Scene& s) { s.forces = {push(Vec3::Zero(), 1e-3)}; }, Elasticity::cauchy); }},
        Load{"ball",
             [] {
               return held_and(
                   [](Scene& s) {
                     Contact ball;
                     ball.name = "ball";
                     ball.obstacle = Ball{{60, -75, 0}, 20};
                     ball.by = {0, 25, 0};
                     ball.stiffness = 0.05;
                     s.contacts = {ball};
                   },
                   Elasticity::corotational);
             }}),
    [](const auto& of) { return fmt::format("n{}", of.index); });

}  // namespace test_graded_cells
