// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <set>

#include "kernels/alike_product.h"
#include "kernels/cell_matrices.h"
#include "solver/kernels/reference.h"
#include "solver/kernels/symmetric_matrix.h"
#include "terms/term.h"

namespace test_cell_matrices {

using namespace hexsolver;
using namespace testing_support;

TEST(CellMatrices, KeepAndMultiplyThoseThatAreSharedAndThoseThatAreNot) {
  const Lattice lattice = box({17, 3, 2}, {1, 1, 1});
  const Mesh mesh(lattice.levels[0].cells, lattice.cell_edges(0), lattice.corner());
  // A layer that shares all, one of two matrices by turns, rows with one cell of its own, and no sharing at all.
  std::vector<std::int32_t> shared(mesh.num_cells(), 4);
  for (std::size_t c = 0; c < shared.size(); ++c) {
    if (mesh.cells()[c][1] == 1) shared[c] = c % 2 == 0 ? 4 : 0;
    if (mesh.cells()[c][1] == 2 && mesh.cells()[c][0] == 3) shared[c] = Term::own_hessian;
  }
  const auto matrix_of = [](std::int32_t number) { return symmetric(20 + static_cast<unsigned>(number)); };
  for (const bool shares : {true, false}) {
    CellMatrices<double> matrices(mesh, shares ? shared : std::vector<std::int32_t>{});
    CellMatrices<float> single(mesh, shares ? shared : std::vector<std::int32_t>{});
    std::vector<CellMatrix> of_cell;
    for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
      const bool is_own = matrices.shared(c) == Term::own_hessian;
      of_cell.push_back(is_own ? symmetric(100 + static_cast<unsigned>(c)) : matrix_of(shared[c]));
      if (!is_own) continue;
      matrices.set(c, of_cell[c]);
      single.set(c, of_cell[c]);
    }
    matrices.set_shared(matrix_of);
    single.set_shared(matrix_of);
    const NodeVector x = noise(mesh.num_dofs(), 1, 15);
    NodeVector expected = noise(mesh.num_dofs(), 1, 16), found = expected;
    FloatNodeVector found_single = expected.cast<float>();
    for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
      EXPECT_EQ(matrices.get(c), of_cell[c]) << c;
      mesh.scatter_add(c, of_cell[c] * mesh.gather(c, x), expected);
    }
    matrices.add_product(x, found);
    single.add_product(x.cast<float>(), found_single);
    EXPECT_LT((found - expected).norm(), 1e-13 * expected.norm());
    EXPECT_LT((found_single.cast<double>() - expected).norm(), 1e-5 * expected.norm());
    EXPECT_EQ(matrices.alike(0).full != nullptr, shares);
  }
}

TEST(CellMatrices, AreHalfAsLargePackedAndLieWhereRegistersTakeThem) {
  EXPECT_EQ(sizeof(SymmetricCells<float>), 8 * sizeof(float) * 24 * 25 / 2);
  EXPECT_EQ(sizeof(SymmetricCells<double>), 8 * sizeof(double) * 24 * 25 / 2);
  EXPECT_EQ(alignof(SymmetricCells<float>), 8 * sizeof(float));
  EXPECT_EQ(alignof(SymmetricCells<double>), 8 * sizeof(double));
}

/// Full cells of one material are the same mirrored, whatever their edges, on every level, with either change of
/// volume.
TEST(MirroredMatrix, MultipliesAsTheFullOneOfFullCells) {
  const Lattice lattice = box({8, 4, 4}, {1, 1.7, 0.6}, 100, 0.45);
  for (int level = 0; level < 2; ++level)
    for (const Volumetric volumetric : {Volumetric::full, Volumetric::mean}) {
      const Body body(lattice, level, Elasticity::cauchy, volumetric);
      const CellMatrix& k = body.elastic->model(0).stiffness;
      const std::optional<MirroredMatrix<double>> blocks = mirrored(k);
      ASSERT_TRUE(blocks);
      EXPECT_NE(body.elastic->model(0).alike().mirrored, nullptr);
      const MirroredMatrix<float> single_blocks = blocks->cast<float>();
      const Eigen::Matrix<float, 24, 24> single = k.cast<float>();
      const NodeVector x = noise(body.mesh.num_dofs(), 1, 17);
      NodeVector expected = NodeVector::Zero(x.size()), found = expected;
      FloatNodeVector found_single = expected.cast<float>();
      for (std::size_t n = 0; n < body.mesh.batches().size(); ++n) {
        reference::add_product(
            body.mesh, body.mesh.batches()[n], [&](std::size_t) { return k; }, x, expected);
        add_alike_product({k.data(), &*blocks}, nodes_of_batch(body.mesh, n), x.data(), found.data());
        add_alike_product({single.data(), &single_blocks}, nodes_of_batch(body.mesh, n),
                          FloatNodeVector(x.cast<float>()).data(), found_single.data());
      }
      EXPECT_LT((found - expected).norm(), 1e-13 * expected.norm());
      EXPECT_LT((found_single.cast<double>() - expected).norm(), 1e-5 * expected.norm());
    }
}

TEST(MirroredMatrix, IsNoneOfCellsThatAreNotTheSameMirrored) {
  EXPECT_FALSE(mirrored(symmetric(21)));
  const Body ball(bitten_ball({1, 1, 1}), 1, Elasticity::cauchy);
  std::size_t num_mirrored = 0;
  for (std::size_t c = 0; c < ball.mesh.num_cells(); ++c) {
    const ElementModel& model = ball.elastic->model(c);
    num_mirrored += model.mirrored != nullptr;
    EXPECT_EQ(model.mirrored != nullptr, mirrored(model.stiffness).has_value());
  }
  EXPECT_GT(num_mirrored, 0U);
  EXPECT_LT(num_mirrored, ball.mesh.num_cells());
}

/// In one row, in two, in more, and fewer than eight.
TEST(CellProduct, CellsInRowsAndCellsAnywhereAreMultipliedAlike) {
  const CellMatrix k = symmetric(12);
  const Eigen::Matrix<float, 24, 24> single = k.cast<float>();
  const Lattice lattice = one_material({17, 4, 2}, {1, 1, 1}, [](const Index3& v) { return v[0] < 3 || v[1] < 2; });
  const Mesh mesh(lattice.levels[0].cells, lattice.cell_edges(0), lattice.corner());
  const NodeVector x = noise(mesh.num_dofs(), 1, 13);
  std::set<int> splits;
  for (std::size_t n = 0; n < mesh.batches().size(); ++n) {
    const Mesh::Batch& batch = mesh.batches()[n];
    NodeVector expected = noise(mesh.num_dofs(), 1, 14), found = expected;
    FloatNodeVector found_single = expected.cast<float>();
    reference::add_product(
        mesh, batch, [&](std::size_t) { return k; }, x, expected);
    add_alike_product({k.data(), nullptr}, nodes_of_batch(mesh, n), x.data(), found.data());
    add_alike_product({single.data(), nullptr}, nodes_of_batch(mesh, n), FloatNodeVector(x.cast<float>()).data(),
                      found_single.data());
    EXPECT_LT((found - expected).norm(), 1e-13 * expected.norm());
    EXPECT_LT((found_single.cast<double>() - expected).norm(), 1e-5 * expected.norm());
    splits.insert(batch.split);
  }
  EXPECT_EQ(splits, (std::set<int>{0, 1, 8}));
}

}  // namespace test_cell_matrices
