// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "hexsolver/mesh.h"
#include "support/bodies.h"

using namespace hexsolver;
using namespace testing_support;

namespace {

struct TwoLevels {
  Lattice lattice = bitten_ball({0.8, 0.8, 2.5}, {1, 0, 1}, random_rotation(3));
  Body fine{lattice, 1, Elasticity::cauchy}, coarse{lattice, 2, Elasticity::cauchy};
  Prolongation prolongation{fine.mesh, coarse.mesh, lattice.levels[2].merge};
};

}  // namespace

TEST(Mesh, EveryCellHasItsCornersInOrder) {
  const TwoLevels two;
  const Mesh& mesh = two.fine.mesh;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    for (int a = 0; a < 8; ++a) {
      const auto node = static_cast<std::size_t>(mesh.cell_nodes()[c][static_cast<std::size_t>(a)]);
      for (int d = 0; d < 3; ++d)
        ASSERT_EQ(mesh.nodes()[node][static_cast<std::size_t>(d)],
                  mesh.cells()[c][static_cast<std::size_t>(d)] + (a >> d & 1));
    }
}

TEST(Mesh, ProlongationReproducesLinearFields) {
  const TwoLevels two;
  const auto field = [](const Vec3& x) -> Vec3 { return {x[0] - 2 * x[1], 3 * x[2] + 1, x[0] + x[1] + x[2]}; };
  NodeVector fine;
  two.prolongation.prolongate(sample(two.coarse.mesh, field), fine);
  const NodeVector expected = sample(two.fine.mesh, field);
  EXPECT_LT((fine - expected).norm(), 1e-12 * expected.norm());
}

TEST(Mesh, RestrictionIsTheTransposeOfProlongation) {
  const TwoLevels two;
  const NodeVector a = noise(two.fine.mesh.num_dofs(), 1, 1), b = noise(two.coarse.mesh.num_dofs(), 1, 2);
  NodeVector pb, ra;
  two.prolongation.prolongate(b, pb);
  two.prolongation.restrict_to(a, ra);
  EXPECT_NEAR(a.dot(pb), ra.dot(b), 1e-12 * a.norm() * b.norm());
}

TEST(Mesh, CellLoopsAddUpTheSameForAnyNumberOfThreads) {
  const Lattice lattice = bitten_ball({1, 1, 1});
  const Body body(lattice, 0, Elasticity::corotational);
  const NodeVector u = noise(body.mesh.num_dofs(), 0.1, 4);
  NodeVector one, two, magnitude;
  omp_set_num_threads(1);
  body.potential.gradient(u, one, magnitude);
  omp_set_num_threads(2);
  body.potential.gradient(u, two, magnitude);
  EXPECT_EQ(one, two);
}
