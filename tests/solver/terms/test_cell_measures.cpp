// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <numeric>

#include "hexmesh/lattice/element_tree.h"
#include "support/bodies.h"
#include "terms/cell_measures.h"

namespace test_cell_measures {

using namespace hexsolver;
using namespace testing_support;

TEST(CellMeasures, AreThoseOfAHomogeneousDeformation) {
  const Lattice lattice = bitten_ball({1, 1, 2});
  const Body body(lattice, 1, Elasticity::corotational);
  const Mat3 turn = Eigen::AngleAxisd(0.5, Vec3(1, 2, 2).normalized()).toRotationMatrix();
  const Mat3 stretch = Vec3(0.9, 1.2, 1.05).asDiagonal();
  const auto u = sample(body.mesh, [&](const Vec3& x) -> Vec3 { return turn * stretch * x - x; });
  const CellMeasures m = measure_cells(*body.elastic, u);
  const std::vector<hexmesh::Element> elements = hexmesh::form_elements(lattice, 1);
  for (std::size_t c = 0; c < body.mesh.num_cells(); ++c) {
    EXPECT_NEAR(m.principal_stretch[0][c], 1.2, 1e-9);
    EXPECT_NEAR(m.principal_stretch[1][c], 1.05, 1e-9);
    EXPECT_NEAR(m.principal_stretch[2][c], 0.9, 1e-9);
    EXPECT_NEAR(m.rotation_degrees[c], 0.5 * 180 / std::numbers::pi, 1e-6);
    const hexmesh::Element& e = elements[static_cast<std::size_t>(lattice.levels[1].element[c])];
    const double mu = std::accumulate(e.shear.begin(), e.shear.end(), 0.0) / e.volume();
    const double kappa = std::accumulate(e.bulk.begin(), e.bulk.end(), 0.0) / e.volume();
    // Along the axes of the stretches s: s_i / J times the nominal stress 2 mu (s_i - 1) + lambda tr(S - 1).
    const Vec3 s(0.9, 1.2, 1.05);
    const Vec3 nominal = 2 * mu * (s - Vec3::Ones()) + Vec3::Constant((kappa - 2 * mu / 3) * 0.15);
    const Vec3 stress = nominal.cwiseProduct(s) / s.prod();
    const double expected = std::sqrt(
        (std::pow(stress[0] - stress[1], 2) + std::pow(stress[1] - stress[2], 2) + std::pow(stress[2] - stress[0], 2)) /
        2);
    EXPECT_NEAR(m.von_mises_stress[c], expected, 1e-9 * expected);
    EXPECT_NEAR(m.pressure[c], -stress.sum() / 3, 1e-9 * expected);
  }
  for (const double jacobian : m.min_jacobian) EXPECT_NEAR(jacobian, 0.9 * 1.2 * 1.05, 1e-9);
  for (const double ratio : m.volume_ratio) EXPECT_NEAR(ratio, 0.9 * 1.2 * 1.05, 1e-9);
  for (const double part : m.inverted_part) EXPECT_EQ(part, 0);
}

TEST(CellMeasures, AStretchedBarHasItsForceOverItsAreaNow) {
  // 20 kPa, nu 0.45, stretched by half under uniaxial stress: 10 kPa over the area at rest, 16.65 over that of now.
  const Lattice lattice = box({4, 2, 2}, {2, 2, 2}, 20, 0.45);
  const Mat3 turn = Eigen::AngleAxisd(1.2, Vec3(1, 2, 2).normalized()).toRotationMatrix();
  const Mat3 stretch = Vec3(1.5, 1 - 0.45 * 0.5, 1 - 0.45 * 0.5).asDiagonal();
  const auto measures = [&](Elasticity law, const Mat3& f) {
    const Body body(lattice, 0, law);
    return measure_cells(*body.elastic, sample(body.mesh, [&](const Vec3& x) -> Vec3 { return f * x - x; }));
  };
  const CellMeasures turned = measures(Elasticity::corotational, turn * stretch);
  const CellMeasures small = measures(Elasticity::cauchy, stretch);
  for (std::size_t c = 0; c < turned.pressure.size(); ++c) {
    EXPECT_NEAR(1e3 * turned.von_mises_stress[c], 10 / (0.775 * 0.775), 1e-9);
    EXPECT_NEAR(1e3 * turned.von_mises_stress[c], 16.65, 0.005);
    EXPECT_NEAR(1e3 * turned.pressure[c], -16.65 / 3, 0.002);
    EXPECT_NEAR(1e3 * small.von_mises_stress[c], 10, 1e-9);  // areas do not change
  }
}

// The mean stress of a body follows from the forces on its nodes and their places: sum f x^T = int sigma dv.
TEST(CellMeasures, StressesAreThoseOfTheForcesOnTheNodes) {
  const Mat3 turn = random_rotation(5);
  Mat3 stretch;
  stretch << 1.15, 0.08, -0.05, 0.08, 0.9, 0.03, -0.05, 0.03, 1.05;
  for (const Elasticity law : {Elasticity::cauchy, Elasticity::corotational, Elasticity::neo_hookean,
                               Elasticity::stable_neo_hookean, Elasticity::green_lagrange}) {
    const bool is_small = law == Elasticity::cauchy;
    const Mat3 f = is_small ? stretch : Mat3(turn * stretch);
    const Lattice lattice = one_material({5, 4, 6}, {1, 1.5, 2}, [](const Index3& i) { return i[0] + i[2] < 7; });
    for (int level = 0; level < 2; ++level) {
      const Body body(lattice, level, law, law == Elasticity::green_lagrange ? Volumetric::full : Volumetric::mean);
      const NodeVector u = sample(body.mesh, [&](const Vec3& x) -> Vec3 { return f * x - x; });
      NodeVector forces, magnitude;
      body.potential.gradient(u, forces, magnitude);
      Mat3 sum = Mat3::Zero();
      double volume = 0;
      for (std::size_t n = 0; n < body.mesh.num_nodes(); ++n) {
        const auto at = 3 * static_cast<Eigen::Index>(n);
        const Vec3 x = body.mesh.position(n) + (is_small ? Vec3::Zero() : Vec3(u.segment<3>(at)));
        sum += forces.segment<3>(at) * x.transpose();
      }
      for (std::size_t c = 0; c < body.mesh.num_cells(); ++c) volume += body.elastic->model(c).volume;
      const Mat3 expected = sum / (volume * (is_small ? 1 : f.determinant()));
      for (std::size_t c = 0; c < body.mesh.num_cells(); ++c)
        EXPECT_LT((body.elastic->stress(c, u) - expected).norm(), 1e-9 * expected.norm())
            << "law " << static_cast<int>(law) << " level " << level;
    }
  }
}

TEST(CellMeasures, FoldedMaterialIsFoundInsideOfCells) {
  // The far face of a coarse cell is pushed in at one of its edges: det F varies in the cell, and its mean says little.
  const Lattice lattice = one_material({8, 4, 4}, {1, 1, 1}, [](const Index3& i) { return i[0] < 4 || i[1] < 2; });
  const Body body(lattice, 2, Elasticity::corotational);
  ASSERT_EQ(body.mesh.num_cells(), 2U);
  const auto pushed = [](double by) {
    return [by](const Vec3& x) { return Vec3(x[0] > 7 && x[1] < 0 ? -by : 0, 0, 0); };
  };
  // There det F = 1 - by / 4 (1 - t) with t = 1/8 and 3/8 across the half of the cell that is filled.
  for (const double by : {2.0, 6.0}) {
    const CellMeasures m = measure_cells(*body.elastic, sample(body.mesh, pushed(by)));
    EXPECT_NEAR(m.min_jacobian[0], 1, 1e-12);
    EXPECT_NEAR(m.min_jacobian[1], 1 - by / 4 * (1 - 0.5 / 4), 1e-12);
    EXPECT_NEAR(m.volume_ratio[1], 1 - by / 4 * (1 - 1.0 / 4), 1e-12);
    EXPECT_NEAR(m.inverted_part[1], by > 4 ? 0.5 : 0, 1e-12);
  }
}

}  // namespace test_cell_measures
