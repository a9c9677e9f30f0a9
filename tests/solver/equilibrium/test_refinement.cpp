// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "equilibrium/refinement.h"
#include "hexsolver/equilibrium/equilibrium.h"
#include "hexsolver/scene/scene_files.h"
#include "support/bodies.h"
#include "support/scene_texts.h"

/// Cells graded by the error, with an accuracy.
namespace test_refinement {

using namespace hexsolver;
using namespace testing_support;

/// A bar with holes that is held by an end, on the levels 1 and 0.
struct Pair {
  Lattice lattice = one_material({16, 8, 8}, {1, 1, 1.2},
                                 [](const Index3& i) { return (7 * i[0] + 13 * i[1] + 31 * i[2]) % 11 != 0; });
  Scene scene = parse_scene(std::string("[solve]\naccuracy_mm = 1\n") + held_by_an_end, "test", "");
  LocalLevel coarse{lattice, scene, 1}, fine{lattice, scene, 0};
  NodeVector at_rest;

  Pair() {
    coarse.build(Elasticity::cauchy, nullptr, at_rest);
    fine.build(Elasticity::cauchy, nullptr, at_rest);
    at_rest = fine.make_zero();
  }
  std::vector<bool> divide(const NodeVector& change, double part = 1) {
    return find_cells_to_divide(coarse, fine, at_rest, change, scene, part);
  }
};

TEST(Refinement, CellsThatFollowAChangeAreNotDivided) {
  Pair pair;
  const Mesh &coarse = pair.coarse.problem().mesh(), &fine = pair.fine.problem().mesh();
  NodeVector followed = noise(coarse.num_dofs(), 1);
  for (std::size_t n = 0; n < coarse.num_nodes(); ++n)
    if (coarse.nodes()[n][0] < 2) followed.segment<3>(static_cast<Eigen::Index>(3 * n)).setZero();
  NodeVector change = pair.fine.make_zero();
  pair.fine.prolongate(pair.coarse, followed, change);
  for (const Index3& cell : {Index3{5, 2, 1}, Index3{3, 0, 3}}) {
    NodeVector bent = change;
    for (std::size_t n = 0; n < fine.num_nodes(); ++n)
      if (fine.nodes()[n] == Index3{2 * cell[0] + 1, 2 * cell[1] + 1, 2 * cell[2] + 1})
        bent[static_cast<Eigen::Index>(3 * n)] += 0.1;
    ASSERT_NE(bent, change);
    const std::vector<bool> divided = pair.divide(bent);
    for (std::size_t c = 0; c < divided.size(); ++c) EXPECT_EQ(divided[c], coarse.cells()[c] == cell) << c;
  }
}

/// Where smaller cells can be held by more, the solution moves although cells could follow.
TEST(Refinement, CellsThatAreHeldElsewhereAreDivided) {
  Pair pair;
  const Mesh& coarse = pair.coarse.problem().mesh();
  const NodeVector moved = sample(pair.fine.problem().mesh(), [](const Vec3&) { return Vec3(0, 0, 1); });
  const std::vector<bool> divided = pair.divide(moved);
  EXPECT_TRUE(std::any_of(divided.begin(), divided.end(), [](bool d) { return d; }));
  for (std::size_t c = 0; c < divided.size(); ++c) EXPECT_TRUE(!divided[c] || coarse.cells()[c][0] == 0) << c;
}

TEST(Refinement, TheLessErrorMayBeLeftTheMoreCellsAreDivided) {
  Pair pair;
  const NodeVector change = noise(pair.fine.problem().mesh().num_dofs(), 1);
  const std::vector<bool> some = pair.divide(change, 0.7), more = pair.divide(change, 0.1);
  const auto count = [](const std::vector<bool>& divided) { return std::count(divided.begin(), divided.end(), true); };
  EXPECT_GT(count(more), 1.2 * static_cast<double>(count(some)));
  EXPECT_LT(count(more), static_cast<std::ptrdiff_t>(more.size()));
  for (std::size_t c = 0; c < more.size(); ++c) EXPECT_TRUE(more[c] || !some[c]) << c;
}

struct Case {
  const char* law;
  const char* load;
  bool is_split = false;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.law << " " << c.load << (c.is_split ? " split" : ""); }

/// A bar; split, a gap one voxel wide parts it in two along two thirds of its length.
Lattice bar(bool is_split) {
  return one_material({48, 16, 16}, {1, 1, 1}, [=](const Index3& i) { return !is_split || i[0] < 15 || i[2] != 9; });
}

std::vector<Vec3> displacement_inside(const hexmesh::Result& result) {
  std::vector<Vec3> places;
  for (int x = 0; x < 48; ++x)
    for (int y = 0; y < 16; ++y)
      for (int z = 0; z < 16; ++z)
        if (z != 9) places.emplace_back(x, y, z);
  return testing_support::displacement_inside(result, places);
}

class RefinedByError : public testing::TestWithParam<Case> {
protected:
  /// @param solve  of the table [solve]
  Outcome solve(const std::string& solve) const {
    const Case& c = GetParam();
    const Scene scene =
        parse_scene("[solve]\n" + solve + "\n" + c.law +
                        "\n[[fix]]\nhalfspace = { point_mm = [0.6, 0, 0], normal = [-1, 0, 0] }\n" + c.load,
                    "test", "");
    const Lattice lattice = bar(c.is_split);
    return solve_equilibrium(lattice, scene, finest_level(scene, lattice));
  }
};

TEST_P(RefinedByError, TheAccuracyAskedIsKeptWithFewerCells) {
  const Outcome truth = solve("level = 0\nerror_estimate = \"off\"");
  ASSERT_TRUE(truth.report.converged) << truth.report.reason;
  const std::vector<Vec3> finest = displacement_inside(truth.result);
  const double moved = mean_distance(finest, std::vector<Vec3>(finest.size(), Vec3::Zero()));
  for (const double asked : {0.06, 0.015}) {
    const Outcome found = solve(fmt::format("grading = \"scene\"\naccuracy_mm = {}", asked * moved));
    EXPECT_TRUE(found.report.converged && !found.report.accuracy_missed) << found.report.reason;
    const double error = mean_distance(displacement_inside(found.result), finest);
    EXPECT_LT(error, asked * moved);
    const std::vector<LevelReport>& levels = found.report.levels;
    ASSERT_TRUE(levels.back().error.mean_mm.has_value());
    EXPECT_LT(error, 2 * *levels.back().error.mean_mm);
    EXPECT_GT(3 * error, *levels.back().error.mean_mm);
    EXPECT_LT(levels.back().cells, truth.report.levels.back().cells / 2);
    for (std::size_t n = 1; n < levels.size(); ++n) EXPECT_GT(levels[n].cells, levels[n - 1].cells);
  }
}

TEST_P(RefinedByError, ReactionsAreAsAccurateAsAsked) {
  const Outcome truth = solve("level = 0\nerror_estimate = \"off\"");
  const Outcome found = solve("grading = \"scene\"\naccuracy_reactions = 0.03");
  EXPECT_TRUE(found.report.converged && !found.report.accuracy_missed) << found.report.reason;
  double largest = 0, error = 0;
  for (std::size_t c = 0; c < truth.report.conditions.size(); ++c) {
    const Vec3 there = truth.report.conditions[c].reaction_n;
    largest = std::max(largest, there.norm());
    error = std::max(error, (found.report.conditions[c].reaction_n - there).norm());
  }
  EXPECT_LT(error, 0.03 * largest);
}

/// Their nodes are not those of the level that results have.
TEST(Refinement, ResultsHoldTheForcesOnGradedCells) {
  const Lattice lattice = bar(false);
  const Scene scene =
      parse_scene(std::string("[solve]\ngrading = \"scene\"\nerror_estimate = \"off\"\n") + held_by_an_end, "test", "");
  const Outcome found = solve_equilibrium(lattice, scene, 1);
  ASSERT_TRUE(found.report.converged) << found.report.reason;
  ASSERT_LT(found.report.levels.back().cells, found.result.cells.size());
  const auto sum = [](const std::vector<Vec3>& forces) {
    return std::accumulate(forces.begin(), forces.end(), Vec3(Vec3::Zero()));
  };
  ASSERT_EQ(found.result.load.size(), found.result.nodes.size());
  EXPECT_LT((sum(found.result.load) - found.report.forces.at(0).total_n).norm(), 1e-9);
}

constexpr const char* pull = "[[displace]]\npoint_mm = [47.4, 7, 13]\nradius_mm = 4\nby_mm = [0, 2, 5]\n";
constexpr const char* weight = "[gravity]\nm_s2 = [0, 0, -9.81]\n";

INSTANTIATE_TEST_SUITE_P(Bars, RefinedByError,
                         testing::Values(Case{"strain = \"cauchy\"", pull, true},
                                         Case{"strain = \"corotational\"", pull, true},
                                         Case{"strain = \"corotational\"\nstiffness = \"exact\"", weight},
                                         Case{"law = \"neo-hookean\"", pull}, Case{"strain = \"auto\"", weight, true}));

}  // namespace test_refinement
