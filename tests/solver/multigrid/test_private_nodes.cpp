// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "multigrid/multigrid.h"
#include "multigrid/private_nodes.h"
#include "support/bodies.h"
#include "terms/make_elastic_cells.h"

namespace test_private_nodes {

using namespace hexsolver;
using namespace testing_support;

/// A block with a thin needle, in large cells but for one end.
class Needle : public testing::Test {
protected:
  const Lattice lattice = one_material(
      {29, 16, 16}, {1, 1, 1}, [](const Index3& i) { return i[0] < 16 || (i[1] == 1 && i[2] == 1); }, 100, 0.4);
  const MeshCells cells{lattice, 0, lattice.num_levels() - 1, [](int, const Index3& cell) { return cell[0] == 0; }};
  const Mesh mesh = cells.make_mesh();
  Potential potential{mesh};

  Needle() {
    potential.add(make_elastic_cells(mesh, cells, {}));
    potential.linearize(NodeVector::Zero(static_cast<Eigen::Index>(mesh.num_dofs())), 0);
  }
  PrivateNodes private_nodes() const {
    PrivateNodes out(mesh, [](std::size_t) { return false; });
    out.update([this](std::size_t cell) { return potential.cell_hessian(cell); });
    return out;
  }
  NodeVector apply(const NodeVector& x) const {
    NodeVector y;
    potential.apply(x, y);
    return y;
  }
};

TEST_F(Needle, NodesOfOneCellAloneAreSolvedForExactly) {
  const PrivateNodes nodes = private_nodes();
  ASSERT_TRUE(nodes.any());
  // From rest: what they take off the residual is what their motion does.
  const NodeVector r = noise(mesh.num_dofs(), 1, 3);
  NodeVector left = r, z = NodeVector::Zero(r.size());
  nodes.solve_first(left);
  nodes.solve_last(r, z);
  const std::size_t moved = static_cast<std::size_t>((z.array() != 0).count());
  EXPECT_GE(moved, 3U * 2);
  EXPECT_LT(moved, mesh.num_dofs() / 10);
  EXPECT_LT((r - apply(z) - left).norm(), 1e-9 * r.norm());
  // With others anywhere: no residual is left at them.
  NodeVector u = noise(mesh.num_dofs(), 1, 5);
  nodes.solve_last(r, u);
  const NodeVector residual = r - apply(u);
  for (Eigen::Index d = 0; d < z.size(); ++d) {
    if (z[d] == 0) continue;
    EXPECT_LT(std::abs(left[d]), 1e-9 * r.norm());
    EXPECT_LT(std::abs(residual[d]), 1e-9 * apply(u).norm());
  }
}

TEST_F(Needle, TheCycleWithThemIsSymmetricAndLeavesNothingThere) {
  std::vector<ConstraintPoint> points;
  for (std::size_t c = 0; c < mesh.end_of_size(0); ++c)
    if (mesh.cells()[c][0] == 0) points.push_back({0, static_cast<std::int32_t>(c), NodeWeights::Constant(0.125)});
  const Constraints held(mesh, points);
  const Hierarchy hierarchy(cells);
  ASSERT_GT(hierarchy.meshes.size(), 1U);
  const Multigrid multigrid(hierarchy, potential, held);
  ASSERT_TRUE(multigrid.is_positive());
  NodeVector a = noise(mesh.num_dofs(), 1, 3), b = noise(mesh.num_dofs(), 1, 7), of_a, of_b;
  held.project(a);
  held.project(b);
  multigrid.apply(a, of_a);
  multigrid.apply(b, of_b);
  EXPECT_NEAR(a.dot(of_b), b.dot(of_a), 1e-5 * std::sqrt(a.dot(of_a) * b.dot(of_b)));  // single precision
  EXPECT_GT(a.dot(of_a), 0);
  // And leaves nothing at them.
  NodeVector moved = NodeVector::Zero(a.size());
  private_nodes().solve_last(a, moved);
  const NodeVector residual = a - apply(of_a);
  for (Eigen::Index d = 0; d < moved.size(); ++d) {
    if (moved[d] != 0) {
      EXPECT_LT(std::abs(residual[d]), 1e-9 * a.norm());
    }
  }
}

}  // namespace test_private_nodes
