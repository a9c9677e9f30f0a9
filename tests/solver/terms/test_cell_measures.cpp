// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>
#include <numeric>

#include "hexmesh/lattice/element_tree.h"
#include "support/bodies.h"
#include "terms/cell_measures.h"

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
    // Differences of the principal stresses 2 mu eps_i.
    const double expected = 2 * mu * std::sqrt((0.15 * 0.15 + 0.15 * 0.15 + 0.3 * 0.3) / 2);
    EXPECT_NEAR(m.von_mises_stress[c], expected, 1e-9 * expected);
  }
  for (const double jacobian : m.min_jacobian) EXPECT_NEAR(jacobian, 0.9 * 1.2 * 1.05, 1e-9);
  EXPECT_EQ(m.inverted_cells, 0U);
}
