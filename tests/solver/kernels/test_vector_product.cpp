// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "kernels/vector_product.h"
#include "support/bodies.h"

namespace test_vector_product {

using namespace hexsolver;
using namespace testing_support;

TEST(CellVectors, AreMultipliedWithAndAddedAsCellByCell) {
  const Lattice lattice = box({17, 2, 2}, {1, 1, 1});
  const Mesh mesh(lattice.levels[0].cells, lattice.cell_edges(0), lattice.corner());
  const NodeVector numbers = noise(24 * mesh.num_cells(), 1, 3), x = noise(mesh.num_dofs(), 1, 4),
                   p = noise(mesh.num_cells(), 1, 5);
  const FloatNodeVector single_x = x.cast<float>();
  const auto vector_of = [&](std::size_t c) { return CellVector(numbers.segment<24>(24 * c)); };
  for (std::size_t n = 0; n < mesh.batches().size(); ++n) {
    const Mesh::Batch& batch = mesh.batches()[n];
    LaneVectors<double> v;
    LaneVectors<float> single;
    alignas(64) std::array<double, Mesh::batch_size> factors{}, dots{};
    alignas(64) std::array<float, Mesh::batch_size> single_factors{}, single_dots{};
    NodeVector found = noise(mesh.num_dofs(), 1, 6), expected = found;
    FloatNodeVector found_single = found.cast<float>();
    for (std::size_t lane = 0; lane < batch.count; ++lane) {
      const std::size_t c = batch.first + lane;
      v.set(lane, vector_of(c));
      single.set(lane, vector_of(c));
      factors[lane] = p[c];
      single_factors[lane] = static_cast<float>(p[c]);
      mesh.scatter_add(c, CellVector(p[c] * vector_of(c)), expected);
    }
    dot_with_cells(v, nodes_of_batch(mesh, n), x.data(), dots.data());
    dot_with_cells(single, nodes_of_batch(mesh, n), single_x.data(), single_dots.data());
    for (std::size_t lane = 0; lane < batch.count; ++lane) {
      const double dot = vector_of(batch.first + lane).dot(mesh.gather(batch.first + lane, x));
      EXPECT_NEAR(dots[lane], dot, 1e-13);
      EXPECT_NEAR(static_cast<double>(single_dots[lane]), dot, 1e-5);
    }
    add_multiples_of_cells(v, factors.data(), nodes_of_batch(mesh, n), found.data());
    add_multiples_of_cells(single, single_factors.data(), nodes_of_batch(mesh, n), found_single.data());
    EXPECT_LT((found - expected).norm(), 1e-14 * expected.norm());
    EXPECT_LT((found_single.cast<double>() - expected).norm(), 1e-6 * expected.norm());
  }
}

}  // namespace test_vector_product
