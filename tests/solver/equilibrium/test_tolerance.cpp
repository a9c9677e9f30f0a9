// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>

#include "equilibrium/error_estimator.h"
#include "hexmesh/core/error.h"
#include "hexsolver/equilibrium/equilibrium.h"
#include "hexsolver/scene/scene_files.h"
#include "support/bodies.h"
#include "support/files.h"

/// solve.tolerance = "auto": equations are solved as well as the cells deserve.
namespace test_tolerance {

using namespace hexsolver;
using namespace testing_support;

/// Displacements in the middle of cells of 2 mm.
std::vector<Vec3> displacement_inside(const hexmesh::Result& result) {
  std::vector<Vec3> places;
  for (int x = 1; x < 24; x += 2)
    for (int y = 1; y < 8; y += 2)
      for (int z = 1; z < 8; z += 2) places.emplace_back(x - 0.5, y - 0.5, z - 0.5);
  return testing_support::displacement_inside(result, places);
}

struct Case {
  const char* law;
  double poisson;
  const char* load;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.law << " " << c.poisson << " " << c.load; }

class Tolerance : public testing::TestWithParam<Case> {};

constexpr const char* pull =
    "[[displace]]\nhalfspace = { point_mm = [22, 0, 0], normal = [1, 0, 0] }\nby_mm = [2, 0, -6]\n";
constexpr const char* weight = "[gravity]\nm_s2 = [0, 0, -30]\n";

TEST_P(Tolerance, TheErrorOfTheEquationsIsSmallBesideThatOfTheCells) {
  const Case& c = GetParam();
  const Lattice lattice = box({24, 8, 8}, {1, 1, 1}, 100, c.poisson);
  const auto solve = [&](const std::string& tolerance, int level) {
    const Scene scene =
        parse_scene(std::string("[solve]\n") + c.law + "\nerror_estimate = \"off\"\ntolerance = " + tolerance +
                        "\n[[fix]]\nhalfspace = { point_mm = [1, 0, 0], normal = [-1, 0, 0] }\n" + c.load,
                    "test", "");
    return solve_equilibrium(lattice, scene, level);
  };
  const std::vector<Vec3> truth = displacement_inside(solve("1e-9", 0).result);
  const Outcome found = solve("\"auto\"", 1), sharp = solve("1e-10", 1);
  ASSERT_TRUE(found.report.converged && sharp.report.converged) << found.report.reason;
  EXPECT_EQ(found.report.levels.size(), sharp.report.levels.size());
  const std::vector<Vec3> there = displacement_inside(found.result), exact = displacement_inside(sharp.result);
  const double of_cells = mean_distance(exact, truth), of_equations = mean_distance(there, exact);
  EXPECT_LT(of_equations, 0.1 * of_cells);
  EXPECT_LT(found.report.levels.back().newton.linear_iterations, sharp.report.levels.back().newton.linear_iterations);
  if (c.load == weight) {  // supports carry it
    const BalanceReport& balance = found.report.balance;
    EXPECT_LT(balance.sum().force_n.norm(), 1e-4 * balance.acting.back().force_n.norm());
  }
  // The error is told, nearly.
  const auto told = found.report.levels.back().error.algebraic_mm;
  ASSERT_TRUE(told.has_value());
  EXPECT_GT(*told, 0.1 * of_equations - 1e-8);
}

INSTANTIATE_TEST_SUITE_P(
    Laws, Tolerance,
    testing::Values(Case{"strain = \"cauchy\"", 0.3, weight}, Case{"strain = \"cauchy\"", 0.4999, pull},
                    Case{"strain = \"corotational\"", 0.3, pull}, Case{"strain = \"corotational\"", 0.49, weight},
                    Case{"strain = \"corotational\"", 0.4999, weight}, Case{"law = \"neo-hookean\"", 0.45, pull},
                    Case{"law = \"neo-hookean\"", 0.4999, weight}, Case{"strain = \"green-lagrange\"", 0.3, weight}));

TEST(ToleranceOf, AScene) {
  const auto read = [](const std::string& solve, const std::string& more = "") {
    return parse_scene("[solve]\n" + solve + "\n" + more, "test", "");
  };
  EXPECT_TRUE(read("").finds_tolerance);
  EXPECT_TRUE(read("tolerance = \"auto\"").finds_tolerance);
  EXPECT_FALSE(read("tolerance = 1e-6").finds_tolerance);
  EXPECT_EQ(read("tolerance = 1e-6").tolerance, 1e-6);
  EXPECT_FALSE(read("kind = \"dynamics\"", "[dynamics]\nstep_s = 0.1\nduration_s = 1\n").finds_tolerance);
  EXPECT_FALSE(read("reference = \"loaded\"", "[loaded.gravity]\nm_s2 = [0, 0, 1]\n").finds_tolerance);
  for (const char* bad : {"tolerance = \"fine\"", "tolerance = 0", "tolerance = 1", "tolerance = true"})
    EXPECT_NE(message_of(hexmesh::ErrorKind::input, [&] { read(bad); }).find("expected 1e-13 to 0.1, or \"auto\""),
              std::string::npos)
        << bad;
}

TEST(ToleranceOf, NearIncompressibilityOneCycleSeesLittle) {
  EXPECT_EQ(unseen_by_cycle(box({4, 4, 4}, {1, 1, 1}, 100, 0.3)), 1);
  EXPECT_NEAR(unseen_by_cycle(box({4, 4, 4}, {1, 1, 1}, 100, 0.4999)), 100, 1);  // kappa / mu = 5000
}

}  // namespace test_tolerance
