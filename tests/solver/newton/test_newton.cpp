// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <numbers>

#include "newton/minimize.h"
#include "support/bodies.h"
#include "terms/dead_load.h"

namespace test_newton {

using namespace hexsolver;
using namespace testing_support;

struct Solved {
  NewtonReport report;
  NodeVector u;
};

/// Hold nodes at a field and solve from rest.
Solved solve(const Lattice& lattice, int level, Elasticity elasticity, const std::function<bool(const Vec3&)>& where,
             const std::function<Vec3(const Vec3&)>& field, double tolerance = 1e-10) {
  Body body(lattice, level, elasticity);
  const Hierarchy hierarchy(body.mesh, lattice.corner(), 300);
  const Constraints constraints(body.mesh, hold_nodes(body.mesh, where, field));
  Solved out{{}, NodeVector::Zero(static_cast<Eigen::Index>(body.mesh.num_dofs()))};
  NewtonOptions options;
  options.tolerance = tolerance;
  out.report = minimize(hierarchy, body.potential, constraints, options, out.u);
  return out;
}

class PatchTest : public testing::TestWithParam<int> {};

TEST_P(PatchTest, ALinearFieldOnTheSupportsIsReproducedInsideACutLattice) {
  // One material: a linear field is then in equilibrium whatever part of the cells is filled.
  const hexmesh::LabelVolume volume = make_volume({16, 16, 16}, {1, 1, 1}, [](const Index3& v) {
    return Vec3(v[0] - 7.3, v[1] - 7.9, v[2] - 7.1).norm() < 7.2 || v[0] < 3;
  });
  const Lattice lattice = hexmesh::build_lattice(
      volume, {{volume.segments[0], hexmesh::material_from_units(100, 0.3, 1000), 0, ""}}, {4, {1, 0, 1}});
  Mat3 gradient;
  gradient << 0.01, -0.02, 0.005, 0.015, 0.02, -0.01, 0.007, 0.004, -0.015;
  const auto field = [&](const Vec3& x) -> Vec3 { return gradient * x + Vec3(1, 2, 3); };
  // Faces on the surface carry traction in this field: hold all nodes of cells that are not full.
  const hexmesh::Level& level = lattice.levels[static_cast<std::size_t>(GetParam())];
  const Body body(lattice, GetParam(), Elasticity::cauchy);
  std::vector<int> full(body.mesh.num_nodes());
  for (std::size_t c = 0; c < body.mesh.num_cells(); ++c)
    for (const std::int32_t n : body.mesh.cell_nodes()[c]) full[static_cast<std::size_t>(n)] += !level.is_boundary(c);
  std::size_t inside = 0;
  for (const int n : full) inside += n == 8;
  ASSERT_GT(inside, 0U);
  const auto boundary = [&](const Vec3& x) {
    for (std::size_t n = 0; n < body.mesh.num_nodes(); ++n)
      if ((body.mesh.position(n) - x).norm() < 1e-9) return full[n] < 8;
    return false;
  };
  const Solved solved = solve(lattice, GetParam(), Elasticity::cauchy, boundary, field);
  EXPECT_TRUE(solved.report.converged) << solved.report.reason;
  EXPECT_LT((solved.u - sample(body.mesh, field)).lpNorm<Eigen::Infinity>(), 1e-8);
}

INSTANTIATE_TEST_SUITE_P(Levels, PatchTest, testing::Values(0, 1));

TEST(Newton, AStretchedBarHasTheForceAndTheNarrowingOfHookesLaw) {
  const Lattice lattice = box({12, 4, 4}, {1, 1, 1}, 100, 0.3);
  // Ends moved along x only, one edge and one node held against rigid motion: uniaxial stress.
  Body body(lattice, 0, Elasticity::cauchy);
  auto points = hold_nodes(
      body.mesh, [](const Vec3& x) { return x[0] < -0.4 || x[0] > 11.4; },
      [](const Vec3& x) { return Vec3(x[0] > 5 ? 0.12 : 0, 0, 0); });
  for (ConstraintPoint& p : points) p.axes = {true, false, false};
  for (const auto& [corner, axes] : {std::pair{Vec3(-0.5, -0.5, -0.5), std::array{false, true, true}},
                                     std::pair{Vec3(-0.5, 3.5, -0.5), std::array{false, false, true}}})
    for (ConstraintPoint p : hold_nodes(
             body.mesh, [&, &c = corner](const Vec3& x) { return (x - c).norm() < 1e-9; },
             [](const Vec3&) { return Vec3::Zero(); })) {
      p.axes = axes;
      points.push_back(p);
    }
  const Hierarchy hierarchy(body.mesh, lattice.corner(), 100);
  const Constraints constraints(body.mesh, points);
  NodeVector u = NodeVector::Zero(static_cast<Eigen::Index>(body.mesh.num_dofs()));
  NewtonOptions options;
  options.tolerance = 1e-11;
  const NewtonReport report = minimize(hierarchy, body.potential, constraints, options, u);
  ASSERT_TRUE(report.converged) << report.reason;
  EXPECT_EQ(report.iterations, 1);  // a linear problem is solved at once, and not more sharply than asked
  EXPECT_GT(report.relative_residual, 1e-3 * options.tolerance);
  const NodeVector expected = sample(body.mesh, [](const Vec3& x) -> Vec3 {
    const Vec3 q = x + Vec3::Constant(0.5);
    return {0.01 * q[0], -0.003 * q[1], -0.003 * q[2]};
  });
  EXPECT_LT((u - expected).lpNorm<Eigen::Infinity>(), 1e-8);
  EXPECT_NEAR(body.potential.energy(u), 0.5 * 0.1 * 0.01 * 0.01 * 12 * 16, 1e-9);
}

TEST(Newton, ABodyTurnedByItsSupportsStoresNoEnergy) {
  const Lattice lattice = bitten_ball({1, 1, 1});
  const Mat3 r = Eigen::AngleAxisd(2.5, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  const Solved solved = solve(
      lattice, 1, Elasticity::corotational, [](const Vec3& x) { return x[0] < 16; },
      [&](const Vec3& x) -> Vec3 { return r * x - x; });
  EXPECT_TRUE(solved.report.converged) << solved.report.reason;
  Body body(lattice, 1, Elasticity::corotational);
  const NodeVector expected = sample(body.mesh, [&](const Vec3& x) -> Vec3 { return r * x - x; });
  EXPECT_LT((solved.u - expected).lpNorm<Eigen::Infinity>(), 1e-5);
}

TEST(Newton, TheTailIsQuadratic) {
  const Lattice lattice = bitten_ball({1, 1, 1});
  for (int level = 0; level < 3; ++level) {
    const Solved solved = solve(
        lattice, level, Elasticity::corotational, [](const Vec3& x) { return x[0] < 14 || x[0] > 24; },
        [&](const Vec3& x) -> Vec3 { return x[0] > 20 ? Vec3(4, 6, 0) : Vec3(0, 0, 0); }, 1e-11);
    EXPECT_TRUE(solved.report.converged) << solved.report.reason;
    EXPECT_LE(solved.report.iterations, 12) << "level " << level;
  }
}

TEST(Newton, MissingSupportsAreNoSuccess) {
  // Held by nothing, with a force that nothing bears and without.
  const Lattice lattice = box({4, 4, 4}, {1, 1, 1});
  for (const bool is_pushed : {false, true}) {
    Body body(lattice, 0, Elasticity::cauchy);
    if (is_pushed)
      body.potential.add(
          std::make_unique<DeadLoad>(EffectKind::force, "push", std::vector<DeadLoad::NodeForce>{{0, {1e-3, 0, 0}}}));
    const Hierarchy hierarchy(body.mesh, lattice.corner(), 50);
    const Constraints constraints(body.mesh, {});
    NodeVector u = noise(body.mesh.num_dofs(), 0.1, 3);
    const NewtonReport report = minimize(hierarchy, body.potential, constraints, {}, u);
    if (is_pushed) {
      EXPECT_FALSE(report.converged);
    } else if (report.converged) {  // as rounding has it: the stiffness is singular
      NodeVector g, magnitude;
      body.potential.gradient(u, g, magnitude);
      EXPECT_LT(g.norm(), 1e-7 * std::max(magnitude.norm(), 1e-3));
    }
  }
}

TEST(Multigrid, PlatesOneVoxelApartTakeTheIterationsOfOne) {
  // Held together at one end. Where coarse cells tie them they take three times as many.
  const auto iterations = [](int num_plates) {
    constexpr int pitch = 8;
    const Lattice lattice = one_material({40, num_plates * pitch - 1, 12}, {1, 1, 1},
                                         [&](const Index3& i) { return i[1] % pitch != pitch - 1 || i[0] < 6; });
    const Solved solved = solve(
        lattice, 0, Elasticity::cauchy, [](const Vec3& x) { return x[0] < 0 || x[0] > 39; },
        [](const Vec3& x) { return Vec3(0, x[0] > 0 ? 1 : 0, 0); }, 1e-8);
    EXPECT_TRUE(solved.report.converged) << solved.report.reason;
    return solved.report.linear_iterations;
  };
  EXPECT_LE(iterations(4), 1.5 * iterations(1));
}

TEST(Multigrid, SinglePointsTakeFewMoreIterationsThanPatches) {
  const Lattice lattice = box({40, 24, 24}, {1, 1, 1});
  const auto iterations = [&](double radius) {
    Body body(lattice, 0, Elasticity::cauchy);
    const Hierarchy hierarchy(body.mesh, lattice.corner(), 300);
    std::vector<ConstraintPoint> points;
    for (const Vec3& at :
         {Vec3(3.5, 3.5, -0.5), Vec3(36.5, 3.5, -0.5), Vec3(3.5, 19.5, -0.5), Vec3(36.5, 19.5, 23.5)}) {
      const auto condition = points.empty() ? 0 : points.back().condition + 1;
      for (ConstraintPoint p : hold_nodes(
               body.mesh, [&](const Vec3& x) { return (x - at).norm() <= radius; },
               [](const Vec3& x) { return Vec3(0, 0, x[2] > 10 ? 3 : 0); })) {
        p.condition = condition;
        points.push_back(p);
      }
    }
    const Constraints constraints(body.mesh, points);
    NewtonOptions options;
    options.tolerance = 1e-8;
    NodeVector u = NodeVector::Zero(static_cast<Eigen::Index>(body.mesh.num_dofs()));
    const NewtonReport report = minimize(hierarchy, body.potential, constraints, options, u);
    EXPECT_TRUE(report.converged) << report.reason;
    return report.linear_iterations;
  };
  const int points = iterations(0.1), patches = iterations(4);
  RecordProperty("points", points);
  RecordProperty("patches", patches);
  EXPECT_LE(points, 1.5 * patches);
}

TEST(Multigrid, IsSymmetricAndFewIterationsSolveALinearBody) {
  const Lattice lattice = bitten_ball({0.8, 0.8, 2.5});
  Body body(lattice, 0, Elasticity::cauchy);
  Hierarchy hierarchy(body.mesh, lattice.corner(), 300);
  ASSERT_GE(hierarchy.meshes.size(), 3U);
  const Constraints constraints(
      body.mesh, hold_nodes(
                     body.mesh, [](const Vec3& x) { return x[0] < 14; }, [](const Vec3&) { return Vec3::Zero(); }));
  NodeVector a = noise(body.mesh.num_dofs(), 1, 1), b = noise(body.mesh.num_dofs(), 1, 2), ma, mb;
  constraints.project(a);
  constraints.project(b);
  for (const bool in_double : {false, true}) {
    hierarchy.in_double = in_double;
    const Multigrid multigrid(hierarchy, body.potential, constraints);
    ASSERT_TRUE(multigrid.is_positive());
    multigrid.apply(a, ma);
    multigrid.apply(b, mb);
    EXPECT_NEAR(a.dot(mb), b.dot(ma), (in_double ? 1e-12 : 1e-5) * std::sqrt(a.dot(ma) * b.dot(mb)));
    EXPECT_GT(a.dot(ma), 0);
  }
}

TEST(Multigrid, SmoothsCarefullyInHardlyMoreIterations) {
  for (const double poisson : {0.3, 0.49}) {  // by Chebyshev's polynomials and by Braess and Sarazin
    const Lattice lattice = box({24, 12, 12}, Vec3::Constant(2.5), 100, poisson);
    Body body(lattice, 0, Elasticity::cauchy);
    const Hierarchy hierarchy(body.mesh, lattice.corner(), 300);
    const Constraints constraints(body.mesh,
                                  hold_nodes(
                                      body.mesh, [&](const Vec3& x) { return x[0] < lattice.corner()[0] + 1e-9; },
                                      [](const Vec3&) { return Vec3::Zero(); }));
    body.potential.linearize(NodeVector::Zero(static_cast<Eigen::Index>(body.mesh.num_dofs())), Hessian::projected);
    const NodeVector b = noise(body.mesh.num_dofs(), 1, 1);
    ConjugateGradients conjugate_gradients;
    ConjugateGradients::Options options;
    options.relative_tolerance = 1e-8;
    Multigrid multigrid(hierarchy, body.potential, constraints);
    NodeVector usual, careful, cycle, careful_cycle;
    multigrid.apply(b, cycle);
    const auto before = conjugate_gradients.solve(body.potential, constraints, &multigrid, b, options, usual);
    multigrid.smooth_carefully();
    multigrid.apply(b, careful_cycle);
    EXPECT_GT((careful_cycle - cycle).norm(), 1e-3 * cycle.norm());
    const auto after = conjugate_gradients.solve(body.potential, constraints, &multigrid, b, options, careful);
    printf("nu = %g: %d iterations, carefully %d\n", poisson, before.iterations, after.iterations);
    EXPECT_EQ(after.end, ConjugateGradients::End::solved);
    EXPECT_LE(after.iterations, 1.5 * before.iterations);
    EXPECT_LT((careful - usual).norm(), 1e-6 * usual.norm());
  }
}

/// A column of 100 x 10 x 10 mm that stands on its end x = 0, under forces on its other end.
struct Column {
  Column(Elasticity elasticity, const Vec3& force)
      : lattice(box({40, 4, 4}, Vec3::Constant(2.5))), body(lattice, 0, elasticity) {
    constexpr double length = 100;
    const double begin = lattice.corner()[0];
    std::vector<DeadLoad::NodeForce> forces;
    for (std::size_t n = 0; n < body.mesh.num_nodes(); ++n) {
      if (body.mesh.position(n)[0] < begin + length - 1e-9) continue;
      top.push_back(n);
      forces.push_back({static_cast<std::int32_t>(n), force / 25});
    }
    body.potential.add(std::make_unique<DeadLoad>(EffectKind::force, "top", forces));
    const Hierarchy hierarchy(body.mesh, lattice.corner(), 300);
    const Constraints constraints(body.mesh, hold_nodes(
                                                 body.mesh, [&](const Vec3& x) { return x[0] < begin + 1e-9; },
                                                 [](const Vec3&) { return Vec3::Zero(); }));
    u = NodeVector::Zero(static_cast<Eigen::Index>(body.mesh.num_dofs()));
    report = minimize(hierarchy, body.potential, constraints, {}, u);
  }
  /// How far the middle of its top has moved sideways [mm].
  double sideways() const {
    double sum = 0;
    for (const std::size_t n : top) sum += u[3 * static_cast<Eigen::Index>(n) + 2];
    return sum / static_cast<double>(top.size());
  }

  Lattice lattice;
  Body body;
  std::vector<std::size_t> top;
  NodeVector u;
  NewtonReport report;
};

/// The deflection of a column's top over its length, under `factor` of the least load that buckles it.
/// Source: Timoshenko, Gere, Theory of Elastic Stability, 2nd ed. (1961), section 2.7: the elastica.
double deflection_of_elastica(double factor) {
  const double quarter = std::numbers::pi / 2 * std::sqrt(factor);
  double low = 0, high = 1;
  while (high - low > 1e-14) {
    const double middle = (low + high) / 2;
    (std::comp_ellint_1(middle) < quarter ? low : high) = middle;
  }
  return 2 * low / quarter;
}

class Buckling : public testing::TestWithParam<Elasticity> {};

TEST_P(Buckling, AColumnBendsAsTheElasticaDoes) {
  constexpr double length = 100;
  // The load that buckles it follows from how much it bends: w = F l^3 / (3 E I), and shear's part, 1.2 F l / (G A).
  const double per_newton = Column(GetParam(), {0, 0, 1e-6}).sideways() / 1e-6;
  const double shear = 1.2 * length / (0.1 / 2.6 * 100);
  const double stiffness = std::pow(length, 3) / 3 / (per_newton - shear);  // E I [N mm^2]
  const double critical = std::pow(std::numbers::pi / 2 / length, 2) * stiffness;
  EXPECT_NEAR(stiffness, 0.1 * std::pow(10, 4) / 12, 0.05 * stiffness);
  for (const double factor : {0.9, 1.01, 1.02, 1.03, 1.04, 1.05, 1.3}) {
    const double load = factor * critical;
    const Column column(GetParam(), {-load, 0, 5e-4 * load});
    ASSERT_TRUE(column.report.converged) << factor << ": " << column.report.reason;
    EXPECT_LE(column.report.iterations, 100);
    const double deflection = column.sideways() / length;
    std::printf("%.2f of the load: %.4f of the length, %d steps\n", factor, deflection, column.report.iterations);
    if (factor < 1)
      EXPECT_LT(deflection, 0.01);
    else if (factor > 1.2)
      EXPECT_NEAR(deflection, deflection_of_elastica(factor), 0.02 * deflection);
    else
      EXPECT_GT(deflection, 0.05);
  }
}

INSTANTIATE_TEST_SUITE_P(Laws, Buckling, testing::Values(Elasticity::corotational, Elasticity::neo_hookean));

}  // namespace test_newton
