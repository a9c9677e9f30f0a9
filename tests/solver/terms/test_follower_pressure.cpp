// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "hexsolver/equilibrium/equilibrium.h"
#include "support/bodies.h"
#include "terms/follower_pressure.h"

namespace test_follower_pressure {

using namespace hexsolver;
using namespace testing_support;

/// On the surface of a ball with a bite taken out, at two levels: cells have many faces of voxels, and partly none.
class Follower : public testing::TestWithParam<int> {
protected:
  const Lattice lattice = bitten_ball({1, 1.2, 2}, {0, 1, 0});
  Mesh mesh{lattice.levels[static_cast<std::size_t>(GetParam())].cells, lattice.cell_edges(GetParam()),
            lattice.corner()};
  Selector selector{{lattice, GetParam()}, mesh};
  const std::vector<SurfacePoint> faces = selector.whole_surface();
  const NodeVector u = noise(mesh.num_dofs(), 0.3, 4), direction = noise(mesh.num_dofs(), 1, 5);
  FollowerPressure closed{"gas", mesh, faces, selector, 0.01, true};

  static NodeVector gradient(const Load& load, const NodeVector& at) {
    NodeVector g = NodeVector::Zero(at.size()), magnitude = g;
    load.add_gradient(at, g, magnitude);
    return g;
  }
};

TEST_P(Follower, UnderAClosedSurfaceForcesAndHessianAreDerivativesOfTheEnergy) {
  constexpr double h = 1e-6;
  const NodeVector g = gradient(closed, u);
  const double measured = (closed.energy(u + h * direction) - closed.energy(u - h * direction)) / (2 * h);
  EXPECT_NEAR(g.dot(direction), measured, 1e-7 * g.norm() * direction.norm());
  closed.linearize(u, Hessian::exact);
  NodeVector claimed = NodeVector::Zero(u.size()), by_cells = claimed;
  closed.add_product(direction, claimed);
  const NodeVector change = (gradient(closed, u + h * direction) - gradient(closed, u - h * direction)) / (2 * h);
  EXPECT_LT((claimed - change).norm(), 1e-6 * change.norm());
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    CellMatrix hessian = CellMatrix::Zero();
    closed.add_cell_hessian(c, hessian);
    mesh.scatter_add(c, CellVector(hessian * mesh.gather(c, direction)), by_cells);
  }
  EXPECT_LT((claimed - by_cells).norm(), 1e-12 * claimed.norm());
}

/// Pressure all around is no force and no moment, however the body is deformed, and W is p times the volume gained.
TEST_P(Follower, UnderAClosedSurfaceForcesHaveNoResultant) {
  const NodeVector g = gradient(closed, u);
  Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
  for (std::size_t n = 0; n < mesh.num_nodes(); ++n) {
    const auto at = 3 * static_cast<Eigen::Index>(n);
    force += g.segment<3>(at);
    moment += (mesh.position(n) + u.segment<3>(at)).cross(Vec3(g.segment<3>(at)));
  }
  const double size = g.cwiseAbs().sum();
  EXPECT_LT(force.norm(), 1e-12 * size);
  EXPECT_LT(moment.norm(), 1e-10 * size);
  EXPECT_LT(closed.total(u).norm(), 1e-12 * size);
  const double stretch = 1.1;
  double volume = 0;
  const NodeVector larger = sample(mesh, [&](const Vec3& x) -> Vec3 { return (stretch - 1) * x; });
  for (const SurfacePoint& f : faces) volume += mesh.rest_position(f.cell, f.weights).dot(f.area) / 3;
  EXPECT_NEAR(closed.energy(larger), 0.01 * (std::pow(stretch, 3) - 1) * volume, 1e-9 * volume);
}

/// Under a part of the surface the symmetric part of the derivative remains; forces turn with the body.
TEST_P(Follower, ForcesTurnWithTheBody) {
  std::vector<SurfacePoint> part;
  for (const SurfacePoint& f : faces)
    if (f.area[0] > 0) part.push_back(f);
  const FollowerPressure open("gas", mesh, part, selector, 0.01, false);
  EXPECT_FALSE(open.is_conservative());
  const Mat3 turn = Eigen::AngleAxisd(1.3, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  const NodeVector turned = sample(mesh, [&](const Vec3& x) -> Vec3 { return turn * x - x; });
  const NodeVector rest = gradient(open, NodeVector::Zero(u.size())), then = gradient(open, turned);
  for (std::size_t n = 0; n < mesh.num_nodes(); ++n) {
    const auto at = 3 * static_cast<Eigen::Index>(n);
    EXPECT_LT((then.segment<3>(at) - turn * rest.segment<3>(at)).norm(), 1e-12 * rest.norm());
  }
  Vec3 area = Vec3::Zero();
  for (const SurfacePoint& f : part) area += f.area;
  EXPECT_LT((open.total(turned) + 0.01 * turn * area).norm(), 1e-12 * area.norm());
}

INSTANTIATE_TEST_SUITE_P(Levels, Follower, testing::Values(0, 1, 2));

/// A block under pressure all around is compressed evenly to a mean Cauchy stress of -p, at any size of the strain.
TEST(FollowerPressure, CompressesABlockEvenly) {
  const Lattice lattice = box({6, 5, 4}, {1, 1, 2}, 10, 0.3);
  for (const Elasticity law : {Elasticity::neo_hookean, Elasticity::stable_neo_hookean}) {
    Scene scene;
    scene.elasticity = law;
    scene.tolerance = 1e-10;
    Force gas;
    gas.name = "gas";
    gas.follows = true;
    gas.pressure = 4e-3;
    gas.selection.halfspace = HalfSpace{Vec3(0, 0, -100), Vec3(0, 0, 1)};
    scene.forces = {gas};
    const std::array<Vec3, 3> corners = {Vec3(-0.5, -0.5, -1), Vec3(5.5, -0.5, -1), Vec3(-0.5, 4.5, -1)};
    for (std::size_t n = 0; n < 3; ++n) {
      Condition c;
      c.name = "corner " + std::to_string(n);
      c.selection.on = SurfacePoints::nodes;
      c.selection.balls = {{corners[n], 0.1}};
      c.axes = {n == 0, n != 2, true};
      scene.conditions.push_back(c);
    }
    const Outcome outcome = solve_equilibrium(lattice, scene, 0);
    ASSERT_TRUE(outcome.report.converged) << outcome.report.reason;
    EXPECT_LT(outcome.report.volume_change, -0.2);
    for (const double p : outcome.result.cell_fields.at("pressure")) EXPECT_NEAR(p, gas.pressure, 1e-8);
    for (const double s : outcome.result.cell_fields.at("von_mises_stress")) EXPECT_LT(s, 1e-8);
    EXPECT_LT(outcome.report.forces.at(0).total_n.norm(), 1e-12);
    for (const ConditionReport& c : outcome.report.conditions) EXPECT_LT(c.reaction_n.norm(), 1e-8);
  }
}

/// An eighth of a thick ball, inflated: u(R) = (R^3 + a^3 - A^3)^(1/3) - R and, of an incompressible neo-Hookean wall,
/// p = 2 mu [1/l + 1/(4 l^4)] from a/A to b/B (Ogden, Non-linear Elastic Deformations, 1984, 5.3). Surfaces are those
/// of voxels: the error is of first order, so that two sizes tell the limit.
TEST(FollowerPressure, InflatesAThickBall) {
  constexpr double inner = 10, outer = 15, pressure = 3e-4, shear = 1e-3;
  const auto f = [](double l) { return 1 / l + 1 / (4 * std::pow(l, 4)); };
  double low = 1, high = 1.3;
  while (high - low > 1e-12) {
    const double l = (low + high) / 2, of_outer = std::cbrt(1 + std::pow(inner / outer, 3) * (l * l * l - 1));
    (2 * shear * (f(of_outer) - f(l)) < pressure ? low : high) = l;
  }
  const double gained = std::pow(low * inner, 3) - std::pow(inner, 3);
  const auto ratio = [&](double voxel) {
    const auto count = static_cast<std::int32_t>(outer / voxel);
    const auto place = [&](const Index3& n) -> Vec3 { return voxel * (Vec3(n[0], n[1], n[2]).array() + 0.5); };
    const Lattice lattice = one_material(
        {count, count, count}, Vec3::Constant(voxel),
        [&](const Index3& n) { return place(n).norm() > inner && place(n).norm() < outer; }, 2999.8e-3, 0.4999);
    Scene scene;
    scene.elasticity = Elasticity::neo_hookean;
    scene.error_estimation = ErrorEstimation::off;
    const Vec3 corner = Vec3::Constant(-voxel / 2);  // centres of voxels count from (0, 0, 0)
    for (int d = 0; d < 3; ++d) {
      Condition c;
      c.name = std::string(1, "xyz"[d]);
      c.selection.halfspace = HalfSpace{corner + 1e-3 * Vec3::Unit(d), -Vec3::Unit(d)};
      c.axes = {d == 0, d == 1, d == 2};
      scene.conditions.push_back(c);
    }
    Force gas;
    gas.name = "gas";
    gas.follows = true;
    gas.pressure = pressure;
    gas.selection.balls = {{corner, 1.05 * inner}};
    gas.selection.max_distance = outer;
    scene.forces = {gas};
    const Outcome outcome = solve_equilibrium(lattice, scene, 0);
    EXPECT_TRUE(outcome.report.converged) << outcome.report.reason;
    double found = 0, expected = 0;
    for (std::size_t n = 0; n < outcome.result.nodes.size(); ++n) {
      const Vec3 x = outcome.result.nodes[n] - corner;
      const double radius = x.norm();
      found += outcome.result.displacement[n].dot(x) / radius;
      expected += std::cbrt(std::pow(radius, 3) + gained) - radius;
    }
    return found / expected;
  };
  const double coarse = ratio(1.25), fine = ratio(0.625);
  EXPECT_NEAR(coarse, 1, 0.12);  // 4 voxels in the wall
  EXPECT_NEAR(fine, 1, 0.06);
  EXPECT_NEAR(2 * fine - coarse, 1, 0.015) << "what is left is of second order";
}

}  // namespace test_follower_pressure
