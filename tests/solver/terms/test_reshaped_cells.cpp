// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "support/bodies.h"
#include "terms/make_elastic_cells.h"

namespace test_reshaped_cells {

using namespace hexsolver;
using namespace testing_support;

struct Case {
  Elasticity law;
  Volumetric volumetric;
  int level;
};

/// Two materials, cells partly filled, at rest elsewhere than on the lattice.
class Reshaped : public testing::TestWithParam<Case> {
protected:
  std::unique_ptr<ElasticCells> make(const MeshCells& of, const Mesh& on) const {
    ElasticSettings settings;
    settings.elasticity = GetParam().law;
    settings.volumetric = GetParam().volumetric;
    settings.is_reshaped = true;
    return make_elastic_cells(on, of, settings);
  }
  NodeVector gradient(const Term& term, const NodeVector& u) const {
    NodeVector g = NodeVector::Zero(u.size()), magnitude = g;
    term.add_gradient(u, g, magnitude);
    return g;
  }

  const Lattice lattice = bitten_ball({1, 1.2, 2}, {0, 1, 0});
  const MeshCells cells{lattice, GetParam().level};
  Mesh mesh = cells.make_mesh();
  const std::unique_ptr<ElasticCells> elastic = make(cells, mesh);
  const NodeVector zero = NodeVector::Zero(static_cast<Eigen::Index>(mesh.num_dofs()));
  const Mat3 turn = Eigen::AngleAxisd(0.8, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  /// Turned, sheared and shaken.
  const NodeVector to_rest =
      sample(mesh, [&](const Vec3& x) -> Vec3 { return turn * Vec3(1.2 * x[0] + 0.2 * x[1], 0.9 * x[1], x[2]) - x; }) +
      noise(mesh.num_dofs(), 0.1, 7);
};

TEST_P(Reshaped, OnTheLatticeCellsAreWhatTheyWere) {
  const NodeVector u = noise(mesh.num_dofs(), 0.1, 3);
  const NodeVector before = gradient(*elastic, u);
  const double energy = elastic->energy(u);
  ASSERT_TRUE(elastic->set_rest(zero));
  EXPECT_NEAR(elastic->energy(u), energy, 1e-12 * energy);
  EXPECT_LT((gradient(*elastic, u) - before).norm(), 1e-12 * before.norm());
}

TEST_P(Reshaped, ForcesOnTheLatticeAreThoseOfCellsAtRestElsewhere) {
  NodeVector expected = zero, magnitude = zero;
  ASSERT_TRUE(elastic->add_gradient_on_lattice(to_rest, expected, magnitude));
  ASSERT_TRUE(elastic->set_rest(to_rest));
  EXPECT_LT((gradient(*elastic, zero) - expected).norm(), 1e-12 * expected.norm());
  elastic->move_to(zero);  // by the kernels of batches, where a law has them
  EXPECT_LT((gradient(*elastic, zero) - expected).norm(), 1e-12 * expected.norm());
  const NodeVector moved = noise(mesh.num_dofs(), 0.1, 11);
  const NodeVector one_by_one = gradient(*elastic, moved);
  elastic->move_to(moved);
  EXPECT_LT((gradient(*elastic, moved) - one_by_one).norm(), 1e-11 * one_by_one.norm());
}

TEST_P(Reshaped, AtRestNothingIsStored) {
  ASSERT_TRUE(elastic->set_rest(to_rest));
  const double stored = elastic->energy(zero);
  EXPECT_GT(stored, 0);
  // Of cells that rotate it is a difference of two, either way.
  EXPECT_LE(std::abs(elastic->energy(to_rest)),
            GetParam().law == Elasticity::corotational ? elastic->energy_rounding() : 1e-20 * stored);
  EXPECT_LT(gradient(*elastic, to_rest).norm(), 1e-11 * gradient(*elastic, zero).norm());
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    EXPECT_LT((elastic->mean_gradient(c, to_rest) - Mat3::Identity()).norm(), 1e-12);
    EXPECT_NEAR(elastic->jacobians(c, to_rest).least, 1, 1e-12);
    EXPECT_LT(elastic->stress(c, to_rest).norm(), 1e-12);
  }
}

TEST_P(Reshaped, ForcesAndHessianAreDerivatives) {
  ASSERT_TRUE(elastic->set_rest(to_rest));
  constexpr double h = 1e-6;
  const NodeVector u = noise(mesh.num_dofs(), 0.1, 3), direction = noise(mesh.num_dofs(), 1, 5);
  const NodeVector g = gradient(*elastic, u);
  const double measured = (elastic->energy(u + h * direction) - elastic->energy(u - h * direction)) / (2 * h);
  EXPECT_NEAR(g.dot(direction), measured, 1e-6 * g.norm() * direction.norm());
  elastic->linearize(u, Hessian::exact);
  NodeVector claimed = zero;
  elastic->add_product(direction, claimed);
  const NodeVector change = (gradient(*elastic, u + h * direction) - gradient(*elastic, u - h * direction)) / (2 * h);
  EXPECT_LT((claimed - change).norm(), 1e-5 * change.norm());
}

/// A lattice stretched along its axes is the lattice of that spacing.
TEST_P(Reshaped, CellsAtRestOnAnotherLatticeAreItsCells) {
  const Vec3 stretch(1.3, 0.8, 1.1);
  const Lattice other = bitten_ball(Vec3(1, 1.2, 2).cwiseProduct(stretch), {0, 1, 0});
  const MeshCells other_cells{other, GetParam().level};
  Mesh other_mesh = other_cells.make_mesh();
  const std::unique_ptr<ElasticCells> expected = make(other_cells, other_mesh);
  NodeVector there(mesh.num_dofs());
  for (std::size_t n = 0; n < mesh.num_nodes(); ++n)
    there.segment<3>(3 * static_cast<Eigen::Index>(n)) = other_mesh.position(n) - mesh.position(n);
  ASSERT_TRUE(elastic->set_rest(there));
  const NodeVector u = noise(mesh.num_dofs(), 0.1, 3);
  // Which points stay when they are thinned out hangs on rounding; any of them have the same moments.
  const bool has_own_points = is_hyperelastic(GetParam().law) && GetParam().level > 0;
  const double tolerance = has_own_points ? 1e-4 : 1e-10;
  EXPECT_NEAR(elastic->energy(there + u), expected->energy(u), tolerance * expected->energy(u));
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    EXPECT_LT((elastic->stress(c, there + u) - expected->stress(c, u)).norm(), tolerance);
    EXPECT_NEAR(elastic->jacobians(c, there + u).least, expected->jacobians(c, u).least, 1e-12);
  }
}

TEST_P(Reshaped, RestInsideOutIsRefused) {
  if (GetParam().law == Elasticity::cauchy) return;  // small strain forms no cell anew
  const NodeVector mirrored = sample(mesh, [](const Vec3& x) -> Vec3 { return Vec3(-2 * x[0], 0, 0); });
  const NodeVector u = noise(mesh.num_dofs(), 0.1, 3);
  const double before = elastic->energy(u);
  NodeVector forces = zero, magnitude = zero;
  EXPECT_FALSE(elastic->add_gradient_on_lattice(mirrored, forces, magnitude));
  EXPECT_FALSE(elastic->set_rest(mirrored));
  EXPECT_EQ(elastic->energy(u), before);
}

INSTANTIATE_TEST_SUITE_P(Laws, Reshaped,
                         testing::Values(Case{Elasticity::corotational, Volumetric::mean, 0},
                                         Case{Elasticity::corotational, Volumetric::mean, 2},
                                         Case{Elasticity::corotational, Volumetric::full, 1},
                                         Case{Elasticity::neo_hookean, Volumetric::mean, 1},
                                         Case{Elasticity::neo_hookean, Volumetric::full, 2},
                                         Case{Elasticity::stable_neo_hookean, Volumetric::mean, 0},
                                         Case{Elasticity::green_lagrange, Volumetric::full, 1}));

}  // namespace test_reshaped_cells
