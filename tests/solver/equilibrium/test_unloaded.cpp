// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "hexsolver/equilibrium/equilibrium.h"
#include "support/bodies.h"

namespace test_unloaded {

using namespace hexsolver;
using namespace testing_support;

Condition held(const Vec3& point, const Vec3& normal, std::array<bool, 3> axes = {true, true, true}) {
  Condition c;
  c.name = "held " + std::to_string(point[0]) + std::to_string(point[1]) + std::to_string(point[2]);
  c.selection.halfspace = HalfSpace{point, normal};
  c.axes = axes;
  return c;
}

Force push(const Vec3& point, const Vec3& normal, double kpa) {
  Force f;
  f.name = "push";
  f.pressure = 1e-3 * kpa;
  f.selection.halfspace = HalfSpace{point, normal};
  return f;
}

/// Two materials, cells partly filled; held where z is least, under gravity and a pressure from one side.
const Lattice& body() {
  static const Lattice lattice = bitten_ball({1, 1.2, 2}, {0, 1, 0});
  return lattice;
}

Scene loaded_body(Elasticity law, RestMethod method, double gravity) {
  const Mesh mesh = MeshCells(body(), 0).make_mesh();
  Vec3 low = mesh.position(0), high = low;
  for (std::size_t n = 0; n < mesh.num_nodes(); ++n) {
    low = low.cwiseMin(mesh.position(n));
    high = high.cwiseMax(mesh.position(n));
  }

  Scene scene;
  scene.elasticity = law;
  scene.volumetric = law == Elasticity::green_lagrange ? Volumetric::full : Volumetric::mean;
  scene.tolerance = 1e-9;
  scene.conditions = {held(Vec3(0, 0, low[2] + 6), -Vec3::UnitZ())};
  Loaded loaded;
  loaded.method = method;
  loaded.gravity = Vec3(0.3, 0, 1) * gravity;
  loaded.forces = {push(Vec3(high[0] - 8, 0, 0), Vec3::UnitX(), 2e-3 * std::abs(gravity) / 1e3)};
  scene.loaded = loaded;
  return scene;
}

double largest(const std::vector<Vec3>& field) {
  double out = 0;
  for (const Vec3& v : field) out = std::max(out, v.norm());
  return out;
}

struct Case {
  Elasticity law;
  RestMethod method;
  int level;
};

class Unloaded : public testing::TestWithParam<Case> {};

/// Found without load, the body is the scan's again under the scan's loads; nothing else is a rest shape.
TEST_P(Unloaded, ComesBackUnderTheLoads) {
  const auto [law, method, level] = GetParam();
  Scene scene = loaded_body(law, method, 1e6);
  const Outcome rest = solve_equilibrium(body(), scene, level);
  ASSERT_TRUE(rest.report.converged) << rest.report.reason;
  const double away = largest(rest.result.displacement);
  EXPECT_GT(away, 1);
  EXPECT_LE(rest.report.levels.back().newton.iterations, method == RestMethod::newton ? 6 : 60);
  EXPECT_EQ(largest(displacement_from_rest(rest.result)), 0);
  ASSERT_TRUE(rest.report.loaded);
  const double stored = rest.report.loaded->scan->strain_energy_n_mm;
  EXPECT_GT(stored, 0);
  EXPECT_LT(std::abs(rest.report.strain_energy_n_mm), 1e-12 * stored);
  EXPECT_LT(rest.report.loaded->scan->balance.sum().force_n.norm(), 1e-6 * 1e6 * 1e-6);

  scene.gravity = scene.loaded->gravity;
  scene.forces = scene.loaded->forces;
  const Outcome back = solve_equilibrium(body(), scene, level);
  ASSERT_TRUE(back.report.converged) << back.report.reason;
  EXPECT_LT(largest(back.result.displacement), 1e-6 * away);
  EXPECT_NEAR(largest(back.result.rest_displacement), away, 1e-6 * away);

  scene.gravity = -scene.gravity;
  scene.forces.clear();
  const Outcome over = solve_equilibrium(body(), scene, level);
  ASSERT_TRUE(over.report.converged) << over.report.reason;
  EXPECT_GT(largest(over.result.displacement), 1.3 * away);  // from the scan through rest to the other side
}

INSTANTIATE_TEST_SUITE_P(Laws, Unloaded,
                         testing::Values(Case{Elasticity::corotational, RestMethod::newton, 0},
                                         Case{Elasticity::corotational, RestMethod::newton, 2},
                                         Case{Elasticity::corotational, RestMethod::fixed_point, 1},
                                         Case{Elasticity::neo_hookean, RestMethod::newton, 1},
                                         Case{Elasticity::neo_hookean, RestMethod::fixed_point, 1},
                                         Case{Elasticity::stable_neo_hookean, RestMethod::newton, 1},
                                         Case{Elasticity::green_lagrange, RestMethod::newton, 1},
                                         Case{Elasticity::cauchy, RestMethod::newton, 1}));

TEST(UnloadedBody, IsTheSameByBothWays) {
  std::vector<std::vector<Vec3>> found;
  for (const RestMethod method : {RestMethod::newton, RestMethod::fixed_point}) {
    const Outcome rest = solve_equilibrium(body(), loaded_body(Elasticity::neo_hookean, method, 1e6), 1);
    ASSERT_TRUE(rest.report.converged) << rest.report.reason;
    found.push_back(rest.result.displacement);
  }
  double apart = 0;
  for (std::size_t n = 0; n < found[0].size(); ++n) apart = std::max(apart, (found[0][n] - found[1][n]).norm());
  EXPECT_LT(apart, 1e-5);
}

TEST(UnloadedBody, WithoutLoadIsTheScan) {
  const Scene scene = loaded_body(Elasticity::neo_hookean, RestMethod::newton, 0);
  const Outcome rest = solve_equilibrium(body(), scene, 0);
  ASSERT_TRUE(rest.report.converged);
  EXPECT_LT(largest(rest.result.displacement), 1e-14);
  for (const LevelReport& level : rest.report.levels) EXPECT_EQ(level.newton.iterations, 0);
}

TEST(UnloadedBody, TooSoftForItsLoadHasNone) {
  Scene scene = loaded_body(Elasticity::neo_hookean, RestMethod::newton, 0);
  scene.loaded->gravity = Vec3(2e7, 0, 0);
  const Outcome rest = solve_equilibrium(body(), scene, 2);
  EXPECT_FALSE(rest.report.converged);
  EXPECT_GT(rest.report.load_fraction, 0);
  EXPECT_LT(rest.report.load_fraction, 0.5);
  EXPECT_NE(rest.report.reason.find("no shape without load"), std::string::npos) << rest.report.reason;
}

/// A bar of length l as it hangs: sigma(x) = rho g (l - x) is in balance on the lattice, and of a bar that is thin the
/// stretch is that of uniaxial stress, so it is int ds / lambda(sigma(s)) long at rest.
TEST(UnloadedBody, HangingBarIsAsLongAsItsClosedForm) {
  constexpr double length = 60, young = 2e-3, poisson = 0.45, density = 1e-9, gravity = 9.81e3 * 3;
  const double mu = young / (2 * (1 + poisson)), kappa = young / (3 * (1 - 2 * poisson));
  const auto stretch_of = [&](double stress) {  // neo-Hookean: sigma = mu J^(-5/3) (dev b) + kappa (J - 1)
    double axial = 1, lateral = 1;
    for (int n = 0; n < 200; ++n) {
      const auto stresses = [&](double a, double t) {
        const double j = a * t * t, trace = a * a + 2 * t * t, factor = mu * std::pow(j, -5.0 / 3);
        return std::array{factor * (a * a - trace / 3) + kappa * (j - 1),
                          factor * (t * t - trace / 3) + kappa * (j - 1)};
      };
      constexpr double h = 1e-7;
      const auto at = stresses(axial, lateral), by_a = stresses(axial + h, lateral),
                 by_t = stresses(axial, lateral + h);
      Eigen::Matrix2d jacobian;
      jacobian << (by_a[0] - at[0]) / h, (by_t[0] - at[0]) / h, (by_a[1] - at[1]) / h, (by_t[1] - at[1]) / h;
      const Eigen::Vector2d step = jacobian.inverse() * Eigen::Vector2d(stress - at[0], -at[1]);
      axial += 0.5 * step[0];
      lateral += 0.5 * step[1];
    }
    return axial;
  };
  constexpr int steps = 400;
  double expected = 0;
  for (int n = 0; n < steps; ++n)
    expected += length / steps / stretch_of(density * gravity * length * (1 - (n + 0.5) / steps));

  Lattice lattice = box({30, 4, 4}, {2, 2, 2}, 1e3 * young, poisson);
  for (hexmesh::VoxelMaterial& m : lattice.materials) m.material.density = density;
  Scene scene;
  scene.elasticity = Elasticity::neo_hookean;
  scene.conditions = {held(Vec3(-0.9, 0, 0), -Vec3::UnitX(), {true, false, false}),
                      held(Vec3(0, -0.9, 0), -Vec3::UnitY(), {false, true, false}),
                      held(Vec3(0, 0, -0.9), -Vec3::UnitZ(), {false, false, true})};
  Loaded loaded;
  loaded.gravity = Vec3(gravity, 0, 0);
  scene.loaded = loaded;
  const Outcome rest = solve_equilibrium(lattice, scene, 0);
  ASSERT_TRUE(rest.report.converged) << rest.report.reason;
  double end = 0;
  int count = 0;
  for (std::size_t n = 0; n < rest.result.nodes.size(); ++n)
    if (rest.result.nodes[n][0] > length - 1.5) {
      end += rest.result.displacement[n][0];
      ++count;
    }
  EXPECT_LT(expected, 0.75 * length);
  EXPECT_NEAR(length + end / count, expected, 0.005 * expected);
}

}  // namespace test_unloaded
