// SPDX-License-Identifier: Apache-2.0
// The tetrahedra that cells are compared with, against their mathematics and independent solutions.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "baseline/tet_solver.h"
#include "core/rotation.h"
#include "hexmesh/core/error.h"
#include "support/bodies.h"
#include "support/tetrahedra.h"

namespace test_tetrahedra {

using namespace hexsolver;
using namespace testing_support;

constexpr double mu = 0.7, lambda = 1.3;
const Mat3 edges = (Mat3() << 1, 0.2, 0.1, 0, 0.9, 0.3, 0, 0.1, 1.2).finished();

Mat3 deformation(unsigned seed) {
  return random_rotation(seed) * Vec3(0.8, 1.1, 1.4).asDiagonal() * random_rotation(seed + 1);
}

Mat3 direction(unsigned seed) { return Mat3::Map(noise(9, 1, seed).data()); }

class TetLaws : public testing::TestWithParam<TetLaw> {
protected:
  static TetState at(const Mat3& f) { return tet_state(GetParam(), f, edges, mu, lambda); }
};

/// A lattice that only names the material.
hexmesh::Lattice of_material(double young_kpa, double poisson) { return box({2, 2, 2}, {1, 1, 1}, young_kpa, poisson); }

Condition where(const std::string& name, const Vec3& point, const Vec3& normal, const Vec3& by = Vec3::Zero()) {
  Condition c;
  c.name = c.where = name;
  c.selection.halfspace = HalfSpace{point, normal};
  c.by = by;
  return c;
}

/// Those whose forces are a gradient and whose frame is not held.
class TetEnergies : public TetLaws {};

TEST_P(TetEnergies, HaveStressForDerivative) {
  constexpr double h = 1e-5;
  for (unsigned seed = 1; seed < 6; ++seed) {
    const Mat3 f = deformation(seed), d = direction(seed);
    const double difference = (at(f + h * d).energy - at(f - h * d).energy) / (2 * h);
    EXPECT_NEAR(difference, at(f).stress.cwiseProduct(d).sum(), 1e-8);
  }
}

TEST_P(TetEnergies, HaveATangentThatIsTheDerivativeOfTheStress) {
  constexpr double h = 1e-5;
  for (unsigned seed = 1; seed < 6; ++seed) {
    const Mat3 f = deformation(seed), d = direction(seed);
    const Mat3 difference = (at(f + h * d).stress - at(f - h * d).stress) / (2 * h);
    Mat3 product;
    Eigen::Map<Eigen::Matrix<double, 9, 1>>(product.data()) =
        tangent_matrix(at(f).tangent) * Eigen::Map<const Eigen::Matrix<double, 9, 1>>(d.data());
    EXPECT_LT((product - difference).norm(), 1e-8 * product.norm() + 1e-9);
  }
}

TEST_P(TetLaws, OnlyCauchyTakesRotationForStrain) {
  const Mat3 r = random_rotation(3), f = deformation(5);
  const bool turns = GetParam() != TetLaw::cauchy;
  EXPECT_EQ(at(r).stress.norm() < 1e-12, turns);
  if (!turns) return;
  EXPECT_LT((at(r * f).stress - r * at(f).stress).norm(), 1e-12);
}

TEST_P(TetLaws, AreHookesLawNearRest) {
  const Mat3 h = 1e-6 * direction(4), strain = (h + h.transpose()) / 2;
  const Mat3 expected = 2 * mu * strain + lambda * strain.trace() * Mat3::Identity();
  EXPECT_LT((at(Mat3::Identity() + h).stress - expected).norm(), 1e-4 * expected.norm());
}

INSTANTIATE_TEST_SUITE_P(All, TetLaws,
                         testing::Values(TetLaw::cauchy, TetLaw::corotational, TetLaw::corotational_qr,
                                         TetLaw::green_lagrange));
INSTANTIATE_TEST_SUITE_P(All, TetEnergies,
                         testing::Values(TetLaw::cauchy, TetLaw::corotational, TetLaw::green_lagrange));

TEST(FastCorotation, TurnsWithTheFirstEdge) {
  // R maps the frame of the edges at rest to that of the deformed ones: its first axis follows the first edge.
  const Mat3 f = deformation(2);
  const TetState state = tet_state(TetLaw::corotational_qr, f, edges, mu, lambda);
  const Mat3 r = state.tangent.u;
  EXPECT_LT((r.transpose() * r - Mat3::Identity()).norm(), 1e-12);
  const Vec3 before = edges.col(0).normalized(), after = (f * edges.col(0)).normalized();
  EXPECT_LT((r * before - after).norm(), 1e-12);
}

TEST(TetSolver, LinearFieldsAreExactInside) {
  // The patch test: the surface follows a linear field, and so does the inside.
  Mat3 gradient;
  gradient << 0.02, 0.01, -0.03, 0.005, -0.02, 0.01, 0.02, 0.01, 0.03;
  for (const bool is_quadratic : {false, true}) {
    hexmesh::TetMesh mesh = box_of_tets({3, 2, 2}, {3, 3, 3});
    for (std::size_t n = 0; n < mesh.points.size(); ++n)  // not regular inside
      if (!hexmesh::surface_nodes(mesh)[n]) mesh.points[n] += 0.1 * Vec3::Map(noise(3, 1, 1 + n).data());
    if (is_quadratic) mesh = hexmesh::quadratic(std::move(mesh));
    TetProblem problem = make_tet_problem(mesh, of_material(100, 0.3), {});
    const std::vector<bool> on_surface = hexmesh::surface_nodes(mesh);
    for (std::size_t n = 0; n < mesh.points.size(); ++n) {
      if (!on_surface[n]) continue;
      problem.held[n] = {true, true, true};
      problem.prescribed[n] = gradient * mesh.points[n];
    }
    // Not the fast law: its frames depend on the order of the corners, so tetrahedra side by side disagree.
    for (const TetLaw law : {TetLaw::cauchy, TetLaw::corotational, TetLaw::green_lagrange})
      for (const TetLinearSolver solver : {TetLinearSolver::cholesky, TetLinearSolver::conjugate_gradients}) {
        TetReport report;
        const std::vector<Vec3> u = solve_tets(problem, {law, solver, 1e-11}, report);
        EXPECT_TRUE(report.converged) << report.reason;
        for (std::size_t n = 0; n < u.size(); ++n) EXPECT_LT((u[n] - gradient * mesh.points[n]).norm(), 1e-8);
      }
  }
}

TEST(TetSolver, AHangingBeamBendsAsIndependentElementsSay) {
  // 160 x 40 x 40 mm under its weight; tips of C3D20R elements, extrapolated: reference README. E 300 kPa, nu 0.3.
  const hexmesh::TetMesh mesh = hexmesh::quadratic(box_of_tets({160, 40, 40}, {16, 4, 4}));
  Scene scene;
  scene.conditions = {where("wall", {0, 0, 0}, {-1, 0, 0})};
  scene.gravity = {0, 0, -9810};
  const TetProblem problem = make_tet_problem(mesh, of_material(300, 0.3), scene);
  const hexmesh::TetField field(mesh);
  for (const auto& [law, tip] : {std::pair{TetLaw::cauchy, -20.9523}, {TetLaw::green_lagrange, -20.7362}}) {
    TetReport report;
    const std::vector<Vec3> u = solve_tets(problem, {law}, report);
    ASSERT_TRUE(report.converged) << report.reason;
    EXPECT_NEAR(field.at({160, 20, 20}, u)[2] / tip, 1, 0.005);
    printf("hanging beam of quadratic tetrahedra: tip %.3f mm, expected %.3f\n", field.at({160, 20, 20}, u)[2], tip);
  }
}

TEST(TetSolver, LinearTetrahedraComeNearerWithResolutionAndBothSolversAgree) {
  Scene scene;
  scene.conditions = {where("wall", {0, 0, 0}, {-1, 0, 0}), where("end", {40, 0, 0}, {1, 0, 0}, {0, 0, -8})};
  scene.conditions[1].axes = {false, false, true};
  const auto energy = [&](const hexmesh::TetMesh& mesh, TetLinearSolver solver) {
    const TetProblem problem = make_tet_problem(mesh, of_material(100, 0.3), scene);
    TetReport report;
    solve_tets(problem, {TetLaw::corotational, solver, 1e-10}, report);
    EXPECT_TRUE(report.converged) << report.reason;
    return report.strain_energy;
  };
  const double exact = energy(hexmesh::quadratic(box_of_tets({40, 10, 10}, {16, 4, 4})), TetLinearSolver::cholesky);
  double before = 1e9;
  for (const int n : {1, 2, 4}) {
    const hexmesh::TetMesh mesh = box_of_tets({40, 10, 10}, {4 * n, n, n});
    const double stiff = energy(mesh, TetLinearSolver::cholesky);
    EXPECT_NEAR(energy(mesh, TetLinearSolver::conjugate_gradients) / stiff, 1, 1e-9);
    EXPECT_GT(stiff, exact);
    EXPECT_LT(stiff, before);
    before = stiff;
  }
}

TEST(TetSolver, ForcesAddUpToWhatWasAsked) {
  for (const bool is_quadratic : {false, true}) {
    hexmesh::TetMesh mesh = box_of_tets({4, 2, 2}, {4, 2, 2});
    if (is_quadratic) mesh = hexmesh::quadratic(std::move(mesh));
    Scene scene;
    Force force;
    force.name = force.where = "pull";
    force.selection.halfspace = HalfSpace{{4, 0, 0}, {1, 0, 0}};
    force.total = {1, 2, 3};
    scene.forces = {force};
    scene.gravity = {0, 0, -9810};
    const TetProblem problem = make_tet_problem(mesh, of_material(100, 0.3), scene);
    Vec3 sum = Vec3::Zero();
    double mass = 0;
    for (const Vec3& f : problem.force) sum += f;
    for (const double m : problem.mass) {
      EXPECT_GT(m, 0);
      mass += m;
    }
    const double expected_mass = 16 * of_material(100, 0.3).segments[0].material->density;
    EXPECT_NEAR(mass, expected_mass, 1e-12 * expected_mass);
    EXPECT_LT((sum - Vec3(1, 2, 3 - 9810 * expected_mass)).norm(), 1e-12);
  }
}

TEST(TetMotion, ComesToRestInEquilibrium) {
  const hexmesh::TetMesh mesh = box_of_tets({40, 20, 20}, {4, 2, 2});
  Scene scene;
  scene.conditions = {where("wall", {0, 0, 0}, {-1, 0, 0})};
  scene.gravity = {0, 0, -9810};
  const TetProblem problem = make_tet_problem(mesh, of_material(20, 0.3), scene);
  for (const TetLaw law : {TetLaw::corotational, TetLaw::corotational_qr}) {
    TetReport report;
    const std::vector<Vec3> rest = solve_tets(problem, {law, TetLinearSolver::cholesky, 1e-10}, report);
    ASSERT_TRUE(report.converged) << report.reason;
    TetMotion motion(problem, law, 0.05, 50, {4, 0.05});
    for (int n = 0; n < 200; ++n) motion.step();
    const std::vector<Vec3> u = motion.displacement();
    for (std::size_t n = 0; n < u.size(); ++n) EXPECT_LT((u[n] - rest[n]).norm(), 1e-4 * rest.back().norm());
  }
}

TEST(TetMotion, FallsFreely) {
  // Implicit Euler falls by g h^2 n (n + 1) / 2 in n steps.
  const hexmesh::TetMesh mesh = box_of_tets({20, 10, 10}, {2, 1, 1});
  Scene scene;
  scene.gravity = {0, 0, -9810};
  const TetProblem problem = make_tet_problem(mesh, of_material(20, 0.3), scene);
  constexpr double h = 0.01;
  TetMotion motion(problem, TetLaw::corotational, h, 60, {});
  for (int n = 0; n < 5; ++n) motion.step();
  for (const Vec3& u : motion.displacement()) EXPECT_LT((u - Vec3(0, 0, -9810 * h * h * 5 * 6 / 2)).norm(), 1e-6);
}

TEST(TetProblem, RefusesWhatTetrahedraKnowNothingOf) {
  const hexmesh::TetMesh mesh = box_of_tets({1, 1, 1}, {1, 1, 1});
  Scene scene;
  scene.conditions = {where("nowhere", {9, 0, 0}, {1, 0, 0})};
  EXPECT_THROW(make_tet_problem(mesh, of_material(1, 0.3), scene), hexmesh::Error);
  scene.conditions.clear();
  scene.contacts.emplace_back();
  EXPECT_THROW(make_tet_problem(mesh, of_material(1, 0.3), scene), hexmesh::Error);
}

}  // namespace test_tetrahedra
