// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <random>

#include "hexmesh/core/partition.h"
#include "multigrid/multigrid.h"
#include "support/bodies.h"

namespace test_mesh {

using namespace hexsolver;
using namespace testing_support;

struct TwoLevels {
  Lattice lattice = bitten_ball({0.8, 0.8, 2.5}, {1, 0, 1}, random_rotation(3));
  Body fine{lattice, 1, Elasticity::cauchy}, coarse{lattice, 2, Elasticity::cauchy};
  Prolongation prolongation{fine.mesh, coarse.mesh, hexmesh::merge_cells(fine.mesh.cells(), lattice.levels[2].merge)};
};

/// How many sets of cells share no node with one another.
std::size_t num_parts(const Mesh& mesh) {
  hexmesh::Partition parts(mesh.num_nodes());
  std::size_t joined = 0;
  for (const CellNodes& nodes : mesh.cell_nodes())
    for (const std::int32_t node : nodes) joined += parts.join(nodes[0], node);
  return mesh.num_nodes() - joined;
}

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

TEST(Hierarchy, AGapOfOneVoxelIsClosedOnNoLevel) {
  for (int gap = 12; gap < 20; ++gap) {
    const Lattice lattice = one_material({32, 32, 32}, {1, 1, 1}, [&](const Index3& i) { return i[1] != gap; });
    const Hierarchy hierarchy(Body(lattice, 0, Elasticity::cauchy).mesh, lattice.corner(), 600);
    ASSERT_GE(hierarchy.meshes.size(), 4U);
    for (const Mesh& mesh : hierarchy.meshes) EXPECT_EQ(num_parts(mesh), 2U) << "gap at " << gap;
  }
}

TEST(Hierarchy, SpecksAreTiedToWhatIsBesideThem) {
  const Lattice lattice = one_material({33, 16, 16}, {1, 1, 1}, [](const Index3& i) {
    return i[0] < 20 || (i[0] % 2 == 0 && i[1] % 4 == 1 && i[2] % 4 == 1);
  });
  const Hierarchy hierarchy(Body(lattice, 0, Elasticity::cauchy).mesh, lattice.corner(), 50);
  EXPECT_GT(num_parts(hierarchy.meshes.front()), 50U);
  EXPECT_EQ(num_parts(hierarchy.meshes.back()), 1U);
}

TEST(Hierarchy, TwoSidesOfASlitPartInItsCells) {
  // Held together beyond the slit's end, so a coarse cell there belongs to both sides.
  const Lattice lattice = one_material({16, 15, 4}, {1, 1, 1}, [](const Index3& i) { return i[1] != 7 || i[0] >= 10; });
  const Hierarchy hierarchy(Body(lattice, 0, Elasticity::cauchy).mesh, lattice.corner(), 50);
  NodeVector coarse, fine;
  const Mesh& first = hierarchy.meshes[1];
  coarse.setZero(static_cast<Eigen::Index>(first.num_dofs()));
  for (std::size_t c = 0; c < first.num_cells(); ++c)
    for (const std::int32_t node : first.cell_nodes()[c])
      if (first.cells()[c][1] >= 4 && first.cells()[c][0] < 4) coarse.segment<3>(3 * Eigen::Index{node}).setOnes();
  hierarchy.prolongations[0].prolongate(coarse, fine);
  const Mesh& mesh = hierarchy.meshes[0];
  for (std::size_t n = 0; n < mesh.num_nodes(); ++n) {
    if (mesh.nodes()[n][0] > 8) continue;
    EXPECT_EQ(fine[3 * static_cast<Eigen::Index>(n)], mesh.nodes()[n][1] >= 8 ? 1 : 0) << mesh.position(n).transpose();
  }
}

TEST(Hierarchy, AllParentsOfANodeInterpolateItAlike) {
  // Voxels at random: cells that touch at an edge or a corner only, and several parents at one index.
  std::size_t parents_at_taken_indices = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    std::vector<int> filled(20 * 19 * 18);
    for (int& f : filled) f = random() % 100 < 24 + seed;
    const Lattice lattice = one_material({20, 19, 18}, {1, 1, 1}, [&](const Index3& i) {
      return filled[static_cast<std::size_t>(i[0] + 20 * (i[1] + 19 * i[2]))] != 0;
    });
    const Hierarchy hierarchy(Body(lattice, 0, Elasticity::cauchy).mesh, lattice.corner(), 50);
    for (std::size_t l = 0; l + 1 < hierarchy.meshes.size(); ++l) {
      const Mesh &fine = hierarchy.meshes[l], &coarse = hierarchy.meshes[l + 1];
      const hexmesh::Merge& merge = hierarchy.merges[l];
      const NodeVector at_coarse = noise(coarse.num_dofs(), 1, 7);
      NodeVector at_fine;
      hierarchy.prolongations[l].prolongate(at_coarse, at_fine);
      std::vector<int> times_child(fine.num_cells());
      for (std::size_t parent = 0; parent < coarse.num_cells(); ++parent) {
        if (parent > 0 && coarse.cells()[parent] == coarse.cells()[parent - 1]) ++parents_at_taken_indices;
        for (std::size_t slot = 0; slot < 8; ++slot) {
          const std::int32_t number = merge.children[parent][slot];
          if (number < 0) continue;
          const auto child = static_cast<std::size_t>(number);
          ++times_child[child];
          for (std::size_t a = 0; a < 8; ++a) {
            const auto node = static_cast<std::size_t>(fine.cell_nodes()[child][a]);
            Vec3 place;
            for (std::size_t d = 0; d < 3; ++d)
              place[static_cast<Eigen::Index>(d)] =
                  static_cast<double>(fine.nodes()[node][d]) / merge.factor[d] - coarse.cells()[parent][d];
            const hexmesh::NodeWeights weights = hexmesh::shape_functions(place);
            ASSERT_GE(weights.minCoeff(), 0);
            const Vec3 expected = coarse.interpolate(static_cast<std::int32_t>(parent), weights, at_coarse);
            EXPECT_LT((at_fine.segment<3>(3 * static_cast<Eigen::Index>(node)) - expected).norm(), 1e-14);
          }
        }
      }
      EXPECT_EQ(times_child, std::vector<int>(fine.num_cells(), 1));
    }
  }
  EXPECT_GT(parents_at_taken_indices, 10U);
}

TEST(Hierarchy, WithoutGapsAllChildrenAreMerged) {
  const Lattice lattice = one_material(
      {24, 24, 24}, {1, 1, 1}, [](const Index3& i) { return Vec3(i[0] - 11.3, i[1] - 11.9, i[2] - 12.1).norm() < 11; });
  const Hierarchy hierarchy(Body(lattice, 0, Elasticity::cauchy).mesh, lattice.corner(), 300);
  ASSERT_GE(hierarchy.meshes.size(), 3U);
  for (std::size_t l = 0; l + 1 < hierarchy.meshes.size(); ++l) {
    const hexmesh::Merge all = hexmesh::merge_cells(hierarchy.meshes[l].cells(), hierarchy.merges[l].factor);
    EXPECT_EQ(hierarchy.merges[l].parents, all.parents);
    EXPECT_EQ(hierarchy.merges[l].children, all.children);
    EXPECT_EQ(hierarchy.meshes[l + 1].nodes(), hexmesh::number_nodes(all.parents).nodes);
  }
}

}  // namespace test_mesh
