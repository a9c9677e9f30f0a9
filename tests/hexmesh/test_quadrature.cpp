// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "hexmesh/lattice/element_tree.h"
#include "hexmesh/lattice/quadrature.h"
#include "support/bodies.h"

namespace test_quadrature {

using namespace hexmesh;
using namespace testing_support;

/// The triquadratic Lagrange polynomial of point q of {0, 1/2, 1}^3.
double lagrange(int q, const Vec3& at) {
  double product = 1;
  for (int d = 0, number = q; d < 3; ++d, number /= 3) {
    const double t = at[d];
    const std::array<double, 3> l = {(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)};
    product *= l[number % 3];
  }
  return product;
}

/// Largest difference between the points' integrals and the exact ones of the element, over the sum of the latter.
double worst_moment(const std::vector<MaterialPoint>& points, const Element& element) {
  double worst = 0;
  for (int q = 0; q < num_rule_points; ++q) {
    double fill = 0, shear = 0, bulk = 0;
    for (const MaterialPoint& p : points) {
      const double l = lagrange(q, p.local);
      fill += p.volume * l;
      shear += p.shear * l;
      bulk += p.bulk * l;
    }
    const auto n = static_cast<std::size_t>(q);
    worst = std::max({worst, std::abs(fill - element.fill[n]) / element.volume(),
                      std::abs(shear - element.shear[n]) / element.total_shear(),
                      std::abs(bulk - element.bulk[n]) / element.total_bulk()});
  }
  return worst;
}

std::vector<std::vector<MaterialPoint>> form_quadratures(const Lattice& lattice, int level) {
  QuadratureTree tree(lattice);
  std::vector<std::vector<MaterialPoint>> out;
  for (std::size_t e = 0; e < lattice.levels[level].filled.size(); ++e)
    out.push_back(tree.form(level, static_cast<std::int32_t>(e)));
  return out;
}

class Quadrature : public testing::TestWithParam<int> {};

TEST_P(Quadrature, HasTheIntegralsOfTheElementsWithFewPointsInsideTheMaterial) {
  const int level = GetParam();
  const Lattice lattice = bitten_ball({1, 1, 2.5}, {0, 1, 0});
  const std::vector<Element> elements = form_elements(lattice, level);
  const std::vector<std::vector<MaterialPoint>> quadratures = form_quadratures(lattice, level);
  const Level& of = lattice.levels[level];
  ASSERT_EQ(quadratures.size(), elements.size());
  std::size_t most = 0;
  for (std::size_t c = 0; c < of.cells.size(); ++c) {
    const auto e = static_cast<std::size_t>(of.element[c]);
    EXPECT_LT(worst_moment(quadratures[e], elements[e]), 1e-13);
    bool one_material = true;
    const double ratio = quadratures[e][0].shear / quadratures[e][0].volume;
    for (const MaterialPoint& p : quadratures[e]) {
      EXPECT_GT(p.volume, 0);
      EXPECT_GT(p.shear, 0);
      EXPECT_GT(p.bulk, 0);
      one_material = one_material && std::abs(p.shear - ratio * p.volume) < 1e-9 * p.shear;
      Index3 voxel;
      for (int d = 0; d < 3; ++d) voxel[d] = static_cast<int>((of.cells[c][d] + p.local[d]) * of.voxels_per_cell[d]);
      EXPECT_NE(lattice.labels[lattice.voxels.offset(voxel)], 0) << "a point in no material";
    }
    EXPECT_LE(quadratures[e].size(), one_material ? 27U : 81U);
    most = std::max(most, quadratures[e].size());
    if (one_material && of.fill(c) == 1) {
      EXPECT_EQ(quadratures[e].size(), 8U);
    }
  }
  if (level > 1) {
    EXPECT_GT(most, 27U) << "no cell mixes materials: this test sees less than it claims";
  }
}

TEST_P(Quadrature, FollowsGreyValues) {
  const Lattice lattice = grey_ball({1, 1, 1});
  const std::vector<Element> elements = form_elements(lattice, GetParam());
  const std::vector<std::vector<MaterialPoint>> quadratures = form_quadratures(lattice, GetParam());
  for (std::size_t e = 0; e < elements.size(); ++e) EXPECT_LT(worst_moment(quadratures[e], elements[e]), 1e-13);
}

INSTANTIATE_TEST_SUITE_P(Levels, Quadrature, testing::Values(0, 1, 2, 3));

TEST(Thinned, KeepsTheIntegralsOfPointsAnywhere) {
  std::vector<MaterialPoint> points;
  const hexsolver::NodeVector random = noise(4 * 500, 0.5, 8);
  Element exact;
  for (int p = 0; p < 500; ++p) {
    const Vec3 local = random.segment<3>(4 * p) + Vec3::Constant(0.5);
    points.push_back({local, random[4 * p + 3] + 0.5, 2 * random[4 * p + 3] + 1, random[4 * p + 3] + 0.5});
    for (int q = 0; q < num_rule_points; ++q) {
      const auto n = static_cast<std::size_t>(q);
      exact.fill[n] += points.back().volume * lagrange(q, local);
      exact.shear[n] += points.back().shear * lagrange(q, local);
      exact.bulk[n] += points.back().bulk * lagrange(q, local);
    }
  }
  const std::vector<MaterialPoint> few = thinned(points);
  EXPECT_LE(few.size(), 27U);
  EXPECT_LT(worst_moment(few, exact), 1e-12);
}

}  // namespace test_quadrature
