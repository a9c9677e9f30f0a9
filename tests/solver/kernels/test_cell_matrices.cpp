// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Dense>

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
    EXPECT_EQ(matrices.alike(0) != nullptr, shares);
  }
}

TEST(CellMatrices, AreHalfAsLargePackedAndLieWhereRegistersTakeThem) {
  EXPECT_EQ(sizeof(SymmetricCells<float>), 8 * sizeof(float) * 24 * 25 / 2);
  EXPECT_EQ(sizeof(SymmetricCells<double>), 8 * sizeof(double) * 24 * 25 / 2);
  EXPECT_EQ(alignof(SymmetricCells<float>), 8 * sizeof(float));
  EXPECT_EQ(alignof(SymmetricCells<double>), 8 * sizeof(double));
}

TEST(CellProduct, CellsInARowAndCellsAnywhereAreMultipliedAlike) {
  const CellMatrix k = symmetric(12);
  const Eigen::Matrix<float, 24, 24> single = k.cast<float>();
  const Lattice lattice = box({17, 2, 2}, {1, 1, 1});
  const Mesh mesh(lattice.levels[0].cells, lattice.cell_edges(0), lattice.corner());
  const NodeVector x = noise(mesh.num_dofs(), 1, 13);
  int rows = 0;
  for (std::size_t n = 0; n < mesh.batches().size(); ++n) {
    const Mesh::Batch& batch = mesh.batches()[n];
    NodeVector expected = noise(mesh.num_dofs(), 1, 14), found = expected;
    FloatNodeVector found_single = expected.cast<float>();
    reference::add_product(
        mesh, batch, [&](std::size_t) { return k; }, x, expected);
    add_alike_product(k.data(), nodes_of_batch(mesh, n), x.data(), found.data());
    add_alike_product(single.data(), nodes_of_batch(mesh, n), FloatNodeVector(x.cast<float>()).data(),
                      found_single.data());
    EXPECT_LT((found - expected).norm(), 1e-13 * expected.norm());
    EXPECT_LT((found_single.cast<double>() - expected).norm(), 1e-5 * expected.norm());
    rows += batch.is_row;
  }
  EXPECT_GT(rows, 0);
  EXPECT_LT(rows, static_cast<int>(mesh.batches().size()));
}

}  // namespace test_cell_matrices
