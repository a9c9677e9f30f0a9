// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "cell_matrices.h"
#include "support/bodies.h"

using namespace hexsolver;
using namespace testing_support;

namespace {

CellMatrix symmetric(unsigned seed) {
  const NodeVector numbers = noise(576, 1, seed);
  const Eigen::Map<const CellMatrix> m(numbers.data());
  return m + m.transpose();
}

}  // namespace

TEST(CellProduct, InterpolationFromTheParentIsTrilinear) {
  for (const Index3& factor : {Index3{2, 2, 2}, Index3{2, 1, 2}, Index3{1, 1, 2}, Index3{1, 1, 1}})
    for (int slot = 0; slot < 8; ++slot) {
      // Corners of the child among those of the parent.
      CellMatrix l = CellMatrix::Zero();
      for (int a = 0; a < 8; ++a) {
        Vec3 local;
        for (int d = 0; d < 3; ++d)
          local[d] = factor[static_cast<std::size_t>(d)] == 1
                         ? hexmesh::corner_bit(a, d)
                         : 0.5 * (hexmesh::corner_bit(slot, d) + hexmesh::corner_bit(a, d));
        const NodeWeights weights = hexmesh::shape_functions(local);
        for (int b = 0; b < 8; ++b) l.block<3, 3>(3 * a, 3 * b) = weights[b] * Mat3::Identity();
      }
      const CellMatrix k = symmetric(7);
      CellMatrix found = k;
      interpolate_from_parent(slot, factor, found.data());
      EXPECT_LT((found - l.transpose() * k * l).norm(), 1e-13 * k.norm()) << slot;
    }
}

TEST(CellProduct, TheTurnedHessianIsThatOfItsFormula) {
  const CellMatrix k = symmetric(8), before = symmetric(9);
  const NodeVector numbers = noise(216, 1, 10);
  using Rows = Eigen::Matrix<double, 3, 24, Eigen::RowMajor>;
  const Rows t = Eigen::Map<const Rows>(numbers.data()), b = Eigen::Map<const Rows>(numbers.data() + 72),
             z = Eigen::Map<const Rows>(numbers.data() + 144);
  const Mat3 r = random_rotation(11);
  CellMatrix turn = CellMatrix::Zero();
  for (int a = 0; a < 24; a += 3) turn.block<3, 3>(a, a) = r;
  for (const bool clamped : {false, true}) {
    CellMatrix found = before;
    add_turned_hessian(k.data(), t.data(), b.data(), clamped ? z.data() : nullptr, r.data(), found.data());
    CellMatrix inner = k + t.transpose() * b + b.transpose() * t;
    if (clamped) inner += z.transpose() * z;
    const CellMatrix expected = before + turn * inner * turn.transpose();
    EXPECT_LT((found - expected).norm(), 1e-13 * expected.norm());
  }
}

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
    for (std::size_t c = batch.first; c < batch.first + batch.count; ++c)
      mesh.scatter_add(c, k * mesh.gather(c, x), expected);
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
