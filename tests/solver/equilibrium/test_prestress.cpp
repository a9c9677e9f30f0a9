// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "hexmesh/core/error.h"
#include "hexsolver/equilibrium/equilibrium.h"
#include "support/bodies.h"

namespace test_prestress {

using namespace hexsolver;
using namespace testing_support;

constexpr double young = 0.1, poisson = 0.3;  // [MPa]

Condition held(const std::string& name, const Vec3& point, const Vec3& normal, std::array<bool, 3> axes) {
  Condition c;
  c.name = name;
  c.selection.halfspace = HalfSpace{point, normal};
  c.axes = axes;
  return c;
}

/// Its corner's planes slide: nothing but rigid motions is held.
std::vector<Condition> sliding() {
  return {held("x", Vec3(-0.9, 0, 0), -Vec3::UnitX(), {true, false, false}),
          held("y", Vec3(0, -0.9, 0), -Vec3::UnitY(), {false, true, false}),
          held("z", Vec3(0, 0, -0.9), -Vec3::UnitZ(), {false, false, true})};
}

Prestress stretched(const std::string& segment, const Mat3& by) { return {segment, "test", by, {}}; }
Prestress stressed(const std::string& segment, const Mat3& by) { return {segment, "test", {}, by}; }

/// Two segments, "below" and "above" the index `from` along z.
Lattice layers(const Index3& extent, int from, const Vec3& spacing, double young_below, double young_above,
               double nu = poisson) {
  hexmesh::LabelVolume volume = make_volume(extent, spacing, [&](const Index3& i) { return i[2] < from ? 1 : 2; });
  std::vector<hexmesh::LatticeSegment> segments(2);
  segments[0].segment = {1, "below"};
  segments[0].material = hexmesh::Material{young_below, nu, 1e-9};
  segments[1].segment = {2, "above"};
  segments[1].material = hexmesh::Material{young_above, nu, 1e-9};
  hexmesh::LatticeOptions options;
  options.num_levels = 3;
  return build_lattice(volume, segments, options);
}

double largest_off(const hexmesh::Result& result, const std::function<Vec3(const Vec3&)>& expected) {
  double off = 0;
  for (std::size_t n = 0; n < result.nodes.size(); ++n)
    off = std::max(off, (result.displacement[n] - expected(result.nodes[n])).norm());
  return off;
}

struct Case {
  Elasticity law;
  int level;
};
class Prestressed : public testing::TestWithParam<Case> {
protected:
  Scene scene() const {
    Scene s;
    s.elasticity = GetParam().law;
    if (GetParam().law == Elasticity::green_lagrange) s.volumetric = Volumetric::full;
    s.tolerance = 1e-10;
    s.error_estimation = ErrorEstimation::off;
    s.conditions = sliding();
    return s;
  }
};

/// What nothing holds against it is 1 / stretch of its size, without stress.
TEST_P(Prestressed, FreeBodyGivesWay) {
  const Lattice lattice = layers({8, 4, 6}, 3, {2, 2, 2}, young, young);
  Scene s = scene();
  const Mat3 stretch = Vec3(1.2, 1.1, 0.9).asDiagonal();
  s.prestresses = {stretched("below", stretch), stretched("above", stretch)};
  const Outcome out = solve_equilibrium(lattice, s, GetParam().level);
  ASSERT_TRUE(out.report.converged) << out.report.reason;
  const Vec3 corner = lattice.corner();
  EXPECT_LT(largest_off(out.result,
                        [&](const Vec3& x) -> Vec3 { return (stretch.inverse() - Mat3::Identity()) * (x - corner); }),
            1e-6);
  for (const double stress : out.result.cell_fields.at("von_mises_stress")) EXPECT_LT(stress, 1e-6 * young);
}

/// Between walls that hold its ends a bar under tension along itself pulls with E (lambda - 1) A by Hooke's
/// co-rotational law, nothing else.
TEST(PrestressedBar, PullsAtItsEnds) {
  const Lattice lattice = layers({12, 4, 4}, 2, {2, 2, 2}, young, young);
  Scene s;
  s.tolerance = 1e-10;
  s.conditions = sliding();
  s.conditions.push_back(held("end", Vec3(22.9, 0, 0), Vec3::UnitX(), {true, false, false}));
  const Mat3 stretch = Vec3(1.2, 1, 1).asDiagonal();
  s.prestresses = {stretched("below", stretch), stretched("above", stretch)};
  for (const int level : {0, 1, 2}) {
    const Outcome out = solve_equilibrium(lattice, s, level);
    ASSERT_TRUE(out.report.converged) << out.report.reason;
    EXPECT_NEAR(out.report.conditions.back().reaction_n[0], young * 0.2 * 8 * 8, 1e-7) << level;
  }
}

/// Under the traction of its own stress a body is in balance as it is: the scan's shape is the one at rest. Let go, it
/// has the length at which the law bears nothing.
TEST(PrestressedBar, IsAtRestUnderItsOwnTraction) {
  const Lattice lattice = layers({12, 4, 4}, 2, {2, 2, 2}, young, young);
  constexpr double stress = 0.015;
  Scene s;
  s.elasticity = Elasticity::neo_hookean;
  s.tolerance = 1e-10;
  s.conditions = sliding();
  const Mat3 along = Vec3(stress, 0, 0).asDiagonal();
  s.prestresses = {stressed("below", along), stressed("above", along)};
  Loaded loaded;
  Force pull;
  pull.name = "pull";
  pull.selection.halfspace = HalfSpace{Vec3(22.9, 0, 0), Vec3::UnitX()};
  pull.total = Vec3(stress * 8 * 8, 0, 0);
  loaded.forces = {pull};
  s.loaded = loaded;
  const Outcome out = solve_equilibrium(lattice, s, 1);
  ASSERT_TRUE(out.report.converged) << out.report.reason;
  for (const Vec3& v : out.result.rest_displacement) EXPECT_LT(v.norm(), 1e-7);
  for (const double pressure : out.result.cell_fields.at("loaded_pressure")) EXPECT_NEAR(pressure, -stress / 3, 1e-9);
  for (const double v : out.result.cell_fields.at("von_mises_stress")) EXPECT_LT(v, 1e-7);

  s.loaded.reset();
  s.forces = {pull};
  const Outcome same = solve_equilibrium(lattice, s, 1);
  ASSERT_TRUE(same.report.converged);
  for (const Vec3& v : same.result.displacement) EXPECT_LT(v.norm(), 1e-7);
}

/// A scan that nothing holds against its stretch is in balance where it has none: at rest it is that much larger. Then
/// nothing moves it.
TEST(PrestressedBar, OfAFreeScanIsLargerAtRest) {
  const Lattice lattice = layers({12, 4, 4}, 2, {2, 2, 2}, young, young);
  const Mat3 stretch = Vec3(1.3, 1, 0.9).asDiagonal();
  for (const Elasticity law : {Elasticity::cauchy, Elasticity::corotational, Elasticity::neo_hookean})
    for (const RestMethod method : {RestMethod::newton, RestMethod::fixed_point}) {
      Scene s;
      s.elasticity = law;
      s.tolerance = 1e-10;
      s.conditions = sliding();
      s.prestresses = {stretched("below", stretch), stretched("above", stretch)};
      s.loaded = Loaded{.method = method};
      const Outcome out = solve_equilibrium(lattice, s, 1);
      ASSERT_TRUE(out.report.converged) << out.report.reason;
      for (std::size_t n = 0; n < out.result.nodes.size(); ++n) {
        const Vec3 expected = (stretch - Mat3::Identity()) * (out.result.nodes[n] - lattice.corner());
        EXPECT_LT((out.result.rest_displacement[n] - expected).norm(), 1e-7);
        EXPECT_LT(out.result.displacement[n].norm(), 1e-7);
      }
    }
}

/// Two layers of which one is stretched curl like a bimetal: curvature 6 e (1 + m)^2 / (h (3 (1 + m)^2 + (1 + m n) (m^2
/// + 1 / (m n)))), m of their heights and n of their moduli. Source: Timoshenko, J. Opt. Soc. Am. 11 (1925) 233.
TEST(PrestressedLayers, CurlLikeABimetal) {
  constexpr int below = 6, above = 4;
  constexpr double strain = 0.004, m = double(above) / below, n = 2, size = 1, height = size * (below + above);
  const Lattice lattice = layers({60, 2, below + above}, below, {size, size, size}, young, n * young, 0);
  Scene s;
  s.conditions = {held("x", Vec3(-0.4, 0, 0), -Vec3::UnitX(), {true, false, false}),
                  held("y", Vec3(0, -0.4, 0), -Vec3::UnitY(), {false, true, false})};
  Condition corner = held("corner", Vec3::Zero(), Vec3::Zero(), {false, false, true});
  corner.selection.halfspace.reset();
  corner.selection.balls = {Ball{Vec3(-0.5, 0, 0), 0}};
  s.conditions.push_back(corner);
  s.prestresses = {stretched("above", Vec3(1 + strain, 1, 1).asDiagonal())};
  const Outcome out = solve_equilibrium(lattice, s, 0);
  ASSERT_TRUE(out.report.converged) << out.report.reason;
  double low = 0, high = 0;
  int ends = 0, begins = 0;
  for (std::size_t k = 0; k < out.result.nodes.size(); ++k) {
    const Vec3& x = out.result.nodes[k];
    if (x[0] > 59) {
      high += out.result.displacement[k][2];
      ++ends;
    } else if (x[0] < 0) {
      low += out.result.displacement[k][2];
      ++begins;
    }
  }
  const double curvature =
      6 * strain * (1 + m) * (1 + m) / (height * (3 * (1 + m) * (1 + m) + (1 + m * n) * (m * m + 1 / (m * n))));
  const double rise = 60 * 60 * curvature / 2;
  EXPECT_NEAR(high / ends - low / begins, rise, 0.02 * rise);
}

/// A cell that both share has their mean stress: where nothing moves but inside, the mean over the
/// body is that of what was asked.
TEST(PrestressedLayers, CellsThatTwoShareHaveTheirMean) {
  const Lattice lattice = layers({8, 4, 6}, 3, {2, 2, 2}, young, young);
  Scene s;
  s.conditions = {held("all", Vec3(-100, 0, 0), Vec3::UnitX(), {true, true, true})};
  const Mat3 stress = 3e-5 * Mat3::Identity();
  s.prestresses = {stressed("above", stress)};
  const Outcome out = solve_equilibrium(lattice, s, 1);
  ASSERT_TRUE(out.report.converged) << out.report.reason;
  const std::vector<double>& pressure = out.result.cell_fields.at("pressure");
  double sum = 0;
  for (std::size_t c = 0; c < pressure.size(); ++c) sum += pressure[c] * out.result.cell_fields.at("fill")[c];
  double fill = 0;
  for (const double f : out.result.cell_fields.at("fill")) fill += f;
  EXPECT_NEAR(sum / fill, -1.5e-5, 1e-8);
}

/// As [loaded] says, with tissue under tension, and an obstacle that presses in the scan: again in balance where it is.
TEST_P(Prestressed, ScanComesBackUnderItsLoads) {
  const Lattice lattice = layers({8, 4, 6}, 3, {2, 2, 2}, young, 3 * young);
  Scene s = scene();
  s.conditions = {held("end", Vec3(-0.9, 0, 0), -Vec3::UnitX(), {true, true, true})};
  s.prestresses = {stretched("above", Vec3(1.1, 1, 0.95).asDiagonal())};
  Contact floor;
  floor.name = "floor";
  floor.obstacle = HalfSpace{Vec3(0, 0, -0.8), Vec3::UnitZ()};
  floor.stiffness = 0.02;
  Loaded loaded;
  loaded.gravity = Vec3(0, 0, -3e5);
  loaded.contacts = {floor};
  s.loaded = loaded;
  s.gravity = loaded.gravity;
  s.contacts = loaded.contacts;
  const Outcome back = solve_equilibrium(lattice, s, GetParam().level);
  ASSERT_TRUE(back.report.converged) << back.report.reason;
  double rest = 0;
  for (const Vec3& v : back.result.rest_displacement) rest = std::max(rest, v.norm());
  EXPECT_GT(rest, 0.1);
  for (const Vec3& v : back.result.displacement) EXPECT_LT(v.norm(), 1e-6 * rest);
  ASSERT_EQ(back.report.loaded->scan->contacts.size(), 1U);
  EXPECT_GT(back.report.loaded->scan->contacts[0].points, 10U);
  EXPECT_LT(back.report.loaded->scan->balance.sum().force_n.norm(), 1e-7);
}

INSTANTIATE_TEST_SUITE_P(Laws, Prestressed,
                         testing::Values(Case{Elasticity::corotational, 0}, Case{Elasticity::corotational, 1},
                                         Case{Elasticity::neo_hookean, 1}, Case{Elasticity::stable_neo_hookean, 2},
                                         Case{Elasticity::green_lagrange, 0}));

TEST(PrestressOfAScene, NamesWhatIsUnknown) {
  const Lattice lattice = layers({8, 4, 6}, 3, {2, 2, 2}, young, young);
  Scene s;
  s.conditions = sliding();
  s.prestresses = {stretched("besides", Mat3::Identity())};
  EXPECT_THROW(solve_equilibrium(lattice, s, 1), hexmesh::Error);
  s.elasticity = Elasticity::corotational;
  s.prestresses = {stressed("below", Vec3(-1, 0, 0).asDiagonal())};
  EXPECT_THROW(solve_equilibrium(lattice, s, 1), hexmesh::Error);
}

}  // namespace test_prestress
