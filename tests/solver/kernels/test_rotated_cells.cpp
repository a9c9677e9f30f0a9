// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "core/rotation.h"
#include "kernels/rotated_cells.h"
#include "solver/kernels/reference.h"

namespace test_rotated_cells {

using namespace hexsolver;
using namespace testing_support;

constexpr std::size_t lanes = Mesh::batch_size;

/// A row of eight cells and four cells that are none, each of a stiffness of its own or all of one.
class RotatedBatches : public testing::TestWithParam<bool> {
protected:
  const Lattice lattice = box({12, 1, 1}, {1, 1.5, 2});
  const Mesh mesh{lattice.levels[0].cells, lattice.cell_edges(0), lattice.corner()};
  std::vector<CellMatrix> k;
  std::vector<NodeGradients> g;
  std::vector<Eigen::Matrix<float, 24, 24>> single_k;
  std::vector<Eigen::Matrix<float, 8, 3>> single_g;
  CellVector rest;

  RotatedBatches() {
    const NodeGradients gradients = hexmesh::shape_gradients(Vec3::Constant(0.5)) * mesh.edges().inverse();
    for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
      const NodeVector numbers = noise(600, 1, GetParam() ? 40 : 40 + static_cast<unsigned>(c));
      const Eigen::Map<const CellMatrix> m(numbers.data());
      k.push_back(m + m.transpose());
      g.push_back(gradients + 0.1 * Eigen::Map<const NodeGradients>(numbers.data() + 576));
      single_k.push_back(k.back().cast<float>());
      single_g.push_back(g.back().cast<float>());
    }
    for (int a = 0; a < 8; ++a)
      for (int d = 0; d < 3; ++d) rest[3 * a + d] = (hexmesh::corner_bit(a, d) - 0.5) * mesh.edges()(d, d);
  }

  template <class Real, class Stiffness, class Gradient>
  LaneModels<Real> models_of(const Mesh::Batch& batch, const Stiffness& stiffness, const Gradient& gradient) const {
    LaneModels<Real> models;
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      const std::size_t c = batch.first + std::min(lane, batch.count - 1);
      models.stiffness[lane] = stiffness[c].data();
      models.mean_gradient[lane] = gradient[c].data();
    }
    if (GetParam()) models.alike.full = models.stiffness[0];
    return models;
  }

  /// Random frames, as if cells were in them.
  RotatedCells<double> random_cells(std::array<reference::Frame, lanes>& frames) const {
    RotatedCells<double> cells;
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      reference::Frame& f = frames[lane];
      const NodeVector numbers = noise(69, 1, 60 + static_cast<unsigned>(lane));
      f.y = numbers.head<24>();
      f.f = numbers.segment<24>(24);
      f.h = numbers.segment<3>(48);
      f.r = random_rotation(80 + static_cast<unsigned>(lane));
      const Eigen::Map<const Mat3> m(numbers.data() + 51), a(numbers.data() + 60);
      f.inverse_m = m + m.transpose();
      f.a = a + a.transpose();
      put(f, cells, lane);
    }
    return cells;
  }

  static void put(const reference::Frame& f, RotatedCells<double>& cells, std::size_t lane) {
    for (std::size_t n = 0; n < 24; ++n) {
      cells.y[n][lane] = f.y[n];
      cells.f[n][lane] = f.f[n];
    }
    for (std::size_t n = 0; n < 9; ++n) cells.r[n][lane] = f.r.data()[n];
    for (std::size_t i = 0, n = 0; i < 3; ++i) {
      cells.h[i][lane] = f.h[i];
      for (std::size_t j = i; j < 3; ++j, ++n) {
        cells.inverse_m[n][lane] = f.inverse_m(i, j);
        cells.a[n][lane] = f.a(i, j);
      }
    }
  }

  static RotatedCells<float> in_single(const RotatedCells<double>& from) {
    RotatedCells<float> to;
    for (std::size_t n = 0; n < sizeof(to) / sizeof(float); ++n)
      to.y[0].data()[n] = static_cast<float>(from.y[0].data()[n]);
    return to;
  }
};

TEST_P(RotatedBatches, ProductsAreThoseOfTheDenseHessians) {
  std::array<reference::Frame, lanes> frames;
  const RotatedCells<double> cells = random_cells(frames);
  PositiveParts positive;
  std::array<Mat3, lanes> b, c;
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    const NodeVector numbers = noise(18, 1, 90 + static_cast<unsigned>(lane));
    for (std::size_t n = 0; n < 9; ++n) {
      positive.b[n][lane] = static_cast<float>(numbers[n]);
      positive.c[n][lane] = static_cast<float>(numbers[9 + n]);
      b[lane].data()[n] = static_cast<double>(positive.b[n][lane]);
      c[lane].data()[n] = static_cast<double>(positive.c[n][lane]);
    }
  }
  const NodeVector x = noise(mesh.num_dofs(), 1, 13);
  const FloatNodeVector single_x = x.cast<float>();
  enum class Stress { none, whole, projected };
  for (const Stress stress : {Stress::none, Stress::whole, Stress::projected})
    for (std::size_t n = 0; n < mesh.batches().size(); ++n) {
      const Mesh::Batch& batch = mesh.batches()[n];
      NodeVector found = noise(mesh.num_dofs(), 1, 14), expected = found;
      FloatNodeVector found_single = found.cast<float>();
      const PositiveParts* part = stress == Stress::projected ? &positive : nullptr;
      add_rotated_product(models_of<double>(batch, k, g), cells, stress == Stress::whole, part, nodes_of_batch(mesh, n),
                          x.data(), found.data());
      LaneModels<float> models = models_of<float>(batch, single_k, single_g);
      SymmetricCells<float> packed;
      for (std::size_t lane = 0; lane < batch.count; ++lane) packed.set(lane, k[batch.first + lane]);
      if (!GetParam()) models.packed = &packed;
      add_rotated_product(models, in_single(cells), stress == Stress::whole, part, nodes_of_batch(mesh, n),
                          single_x.data(), found_single.data());
      reference::add_product(
          mesh, batch,
          [&](std::size_t cell) {
            const std::size_t lane = cell - batch.first;
            const reference::Frame& f = frames[lane];
            const reference::Rows t = reference::t_of(f, g[cell]), l = reference::l_of(f, g[cell]);
            CellMatrix e = CellMatrix::Zero();
            if (stress == Stress::whole) e = t.transpose() * f.a * t + t.transpose() * l + l.transpose() * t;
            if (stress == Stress::projected) {
              const reference::Rows z = b[lane].transpose() * t + c[lane].transpose() * l;
              e = z.transpose() * z;
            }
            return reference::rotated_hessian(k[cell], f, g[cell], e);
          },
          x, expected);
      EXPECT_LT((found - expected).norm(), 1e-13 * expected.norm());
      EXPECT_LT((found_single.cast<double>() - expected).norm(), 1e-5 * expected.norm());
    }
}

TEST_P(RotatedBatches, FramesAndForcesAreThoseOfEachCell) {
  const Mat3 turn = random_rotation(5);
  const NodeVector u =
      sample(mesh, [&](const Vec3& x) -> Vec3 { return turn * Vec3(1.2 * x[0], 0.9 * x[1], x[2]) - x; }) +
      noise(mesh.num_dofs(), 0.1, 15);
  for (std::size_t n = 0; n < mesh.batches().size(); ++n) {
    const Mesh::Batch& batch = mesh.batches()[n];
    RotatedCells<double> cells, expected;
    const LaneModels<double> models = models_of<double>(batch, k, g);
    const NodeVector apart = noise(24 * lanes, 0.05, 16);  // cells that are at rest elsewhere, each for itself
    alignas(64) std::array<double, 24 * lanes> at_rest;
    for (std::size_t i = 0; i < at_rest.size(); ++i)
      at_rest[i] = rest[static_cast<Eigen::Index>(i / lanes)] + apart[static_cast<Eigen::Index>(i)];
    EXPECT_EQ(rotate_cells(models, true, nodes_of_batch(mesh, n), at_rest.data(), u.data(), cells), 0U);
    alignas(64) std::array<double, 24 * lanes> forces;
    forces_of_rotated(models, cells, forces.data());
    for (std::size_t lane = 0; lane < batch.count; ++lane) {
      const std::size_t cell = batch.first + lane;
      CellVector rest_here;
      for (std::size_t i = 0; i < 24; ++i) rest_here[static_cast<Eigen::Index>(i)] = at_rest[lanes * i + lane];
      const CellVector x = mesh.gather(cell, u) + rest_here;
      const Eigen::Map<const Eigen::Matrix<double, 3, 8>> corners(x.data());
      const Vec3 mean = corners.rowwise().mean();
      const Polar polar = polar_decomposition((corners.colwise() - mean) * g[cell]);
      const reference::Frame f =
          reference::frame(k[cell], x, rest_here, polar.rotation, polar.stretch, polar.inverse_m);
      put(f, expected, lane);
      const auto expect_near = [&](const auto& found, const auto& wanted, const char* what) {
        for (std::size_t i = 0; i < found.size(); ++i)
          EXPECT_NEAR(found[i][lane], wanted[i][lane], 1e-11) << what << ' ' << i;
      };
      expect_near(cells.y, expected.y, "y");
      expect_near(cells.f, expected.f, "f");
      expect_near(cells.r, expected.r, "R");
      expect_near(cells.inverse_m, expected.inverse_m, "M^-1");
      expect_near(cells.a, expected.a, "A");
      expect_near(cells.h, expected.h, "h");
      for (int a = 0; a < 8; ++a) {
        const Vec3 force = f.r * (f.f.segment<3>(3 * a) - f.h.cross(Vec3(g[cell].row(a))));
        for (int i = 0; i < 3; ++i) EXPECT_NEAR(forces[lanes * (3 * a + i) + lane], force[i], 1e-11);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(AlikeAndNot, RotatedBatches, testing::Bool());

}  // namespace test_rotated_cells
