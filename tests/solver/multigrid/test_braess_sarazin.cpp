// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "multigrid/braess_sarazin.h"
#include "newton/minimize.h"
#include "support/bodies.h"

namespace test_braess_sarazin {

using namespace hexsolver;
using namespace testing_support;
using Eigen::Index;
using Eigen::MatrixXd;

/// Two plates one voxel apart that hang together at one end: their coarse cells stand beside each other at one index.
Lattice plates(double poisson) {
  return one_material(
      {24, 13, 10}, {1, 1, 1}, [](const Index3& i) { return i[1] != 6 || i[0] < 3; }, 100, poisson);
}

/// Positive and not the same at any two nodes.
std::vector<Mat3> random_blocks(std::size_t count) {
  const NodeVector numbers = noise(9 * count, 1, 3);
  std::vector<Mat3> out;
  for (std::size_t n = 0; n < count; ++n) {
    const Eigen::Map<const Mat3> m(numbers.data() + 9 * n);
    out.push_back(Mat3::Identity() + m * m.transpose());
  }
  return out;
}

MatrixXd dense(const Potential& potential, const Mesh& mesh) {
  MatrixXd k = MatrixXd::Zero(static_cast<Index>(mesh.num_dofs()), static_cast<Index>(mesh.num_dofs()));
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const CellMatrix of_cell = potential.cell_hessian(c);
    for (std::size_t a = 0; a < 8; ++a)
      for (std::size_t b = 0; b < 8; ++b)
        k.block<3, 3>(3 * Index{mesh.cell_nodes()[c][a]}, 3 * Index{mesh.cell_nodes()[c][b]}) +=
            of_cell.block<3, 3>(3 * static_cast<Index>(a), 3 * static_cast<Index>(b));
  }
  return k;
}

/// Columns = f of the unit vectors.
template <class F>
MatrixXd columns_of(Index size, F&& f) {
  MatrixXd out(size, size);
  NodeVector column;
  for (Index n = 0; n < size; ++n) {
    f(NodeVector(NodeVector::Unit(size, n)), column);
    out.col(n) = column;
  }
  return out;
}

TEST(PressureSchurComplement, IsTheProductOfItsFactors) {
  const Lattice lattice = plates(0.3);
  const Body body(lattice, 0, Elasticity::cauchy);
  const Hierarchy hierarchy(body.mesh, lattice.corner(), 50);
  ASSERT_GE(hierarchy.meshes.size(), 3U);
  bool has_doubles = false;
  for (const Mesh& mesh : hierarchy.meshes) {
    const std::vector<Index3>& nodes = mesh.nodes();
    has_doubles = has_doubles || std::adjacent_find(nodes.begin(), nodes.end()) != nodes.end();
    const std::vector<Mat3> inverse = random_blocks(mesh.num_nodes());
    std::vector<bool> left_out(mesh.num_nodes());
    for (std::size_t n = 0; n < mesh.num_nodes(); n += 7) left_out[n] = true;
    const NodeVector numbers = noise(24 * mesh.num_cells(), 1, 5);
    CellRows<double> rows(mesh);
    rows.set([&](std::size_t c) { return CellVector(numbers.segment<24>(24 * static_cast<Index>(c))); },
             [](std::size_t) { return Term::own_hessian; });
    PressureSchurComplement<double> coupling(mesh);
    coupling.set(rows, inverse, left_out);

    const NodeVector x = noise(mesh.num_cells(), 1, 8), gained = noise(mesh.num_cells(), 1, 9),
                     before = noise(mesh.num_cells(), 1, 10);
    const auto num_places = static_cast<Index>(coupling.num_places());
    NodeVector p = NodeVector::Zero(num_places), g = p, next = p;
    NodeVector forces = NodeVector::Zero(static_cast<Index>(mesh.num_dofs()));
    for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
      const auto at = static_cast<Index>(coupling.place(c)), cell = static_cast<Index>(c);
      p[at] = x[cell];
      g[at] = gained[cell];
      next[at] = before[cell];
      mesh.scatter_add(c, x[cell] * numbers.segment<24>(24 * cell), forces);
    }
    for (std::size_t n = 0; n < mesh.num_nodes(); ++n) {
      const Vec3 f = forces.segment<3>(3 * static_cast<Index>(n));
      forces.segment<3>(3 * static_cast<Index>(n)) = left_out[n] ? Vec3(Vec3::Zero()) : Vec3(inverse[n] * f);
    }
    constexpr double of_gained = 0.7, keep = 0.3, add = 0.2;
    coupling.step({of_gained, keep, add}, g, p, next);
    for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
      const auto cell = static_cast<Index>(c);
      const double sx = numbers.segment<24>(24 * cell).dot(mesh.gather(c, forces));
      EXPECT_NEAR(next[static_cast<Index>(coupling.place(c))],
                  x[cell] + keep * (x[cell] - before[cell]) - add * (x[cell] + of_gained * gained[cell] + sx), 1e-12);
    }
    std::size_t elsewhere = 0;
    for (const double v : next) elsewhere += v != 0;
    EXPECT_EQ(elsewhere, mesh.num_cells());  // places without a cell stay empty
  }
  EXPECT_TRUE(has_doubles);
}

TEST(PressureSchurComplement, RowsThatAreSharedGiveWhatTheirCopiesGive) {
  const Lattice lattice = box({20, 6, 5}, {1, 1.5, 1});
  Body body(lattice, 0, Elasticity::cauchy);
  const std::vector<Mat3> inverse(body.mesh.num_nodes(), random_blocks(1)[0]);
  std::vector<bool> left_out(body.mesh.num_nodes());
  const std::vector<Index3>& nodes = body.mesh.nodes();
  left_out[static_cast<std::size_t>(std::find(nodes.begin(), nodes.end(), Index3{10, 3, 3}) - nodes.begin())] = true;
  const CellVector row = noise(24, 1, 4);
  const NodeVector x = noise(body.mesh.num_cells(), 1, 8);
  std::array<NodeVector, 2> next;
  for (const bool shares : {false, true}) {
    CellRows<double> rows(body.mesh);
    rows.set([&](std::size_t) { return row; }, [&](std::size_t) { return shares ? 0 : Term::own_hessian; });
    PressureSchurComplement<double> coupling(body.mesh);
    coupling.set(rows, inverse, left_out);
    NodeVector p = NodeVector::Zero(static_cast<Index>(coupling.num_places())), none = p;
    for (std::size_t c = 0; c < body.mesh.num_cells(); ++c)
      p[static_cast<Index>(coupling.place(c))] = x[static_cast<Index>(c)];
    next[shares] = none;
    coupling.step({0, 0, 1}, none, p, next[shares]);
  }
  EXPECT_LT((next[0] - next[1]).norm(), 1e-13 * next[0].norm());
}

class BraessSarazinSmoothers : public testing::TestWithParam<double> {};

TEST_P(BraessSarazinSmoothers, AreSymmetricAndNeverAmplify) {
  const Lattice lattice = one_material(
      {7, 5, 4}, {1, 1, 1.2}, [](const Index3& i) { return i[0] + i[1] > 1; }, 100, GetParam());
  Body body(lattice, 0, Elasticity::cauchy);
  const auto size = static_cast<Index>(body.mesh.num_dofs());
  body.potential.linearize(NodeVector::Zero(size), Hessian::exact);
  // Held at points within cells: what the nodes keep of their freedom is taken into account.
  std::vector<ConstraintPoint> points;
  for (std::int32_t c = 0; c < 6; ++c) {
    ConstraintPoint p;
    p.cell = c;
    p.weights = hexmesh::shape_functions(Vec3(0.3, 0.4, 0.8));
    points.push_back(p);
  }
  const Constraints constraints(body.mesh, points);
  const MatrixXd k = dense(body.potential, body.mesh), projection = columns_of(size, [&](NodeVector v, NodeVector&out) {
                                                         constraints.project(v);
                                                         out = v;
                                                       });

  // D from A, weighed as the multigrid does it.
  MatrixXd shape = k;
  std::vector<Mat3> blocks(body.mesh.num_nodes(), Mat3::Zero());
  for (std::size_t c = 0; c < body.mesh.num_cells(); ++c) {
    const CellMatrix a = body.potential.cell_hessian(c) - body.potential.dilatation(c).hessian();
    for (int n = 0; n < 8; ++n)
      blocks[static_cast<std::size_t>(body.mesh.cell_nodes()[c][static_cast<std::size_t>(n)])] +=
          a.block<3, 3>(3 * n, 3 * n);
  }
  MatrixXd inverse = MatrixXd::Zero(size, size);
  for (std::size_t n = 0; n < blocks.size(); ++n) {
    blocks[n] = blocks[n].inverse().eval();
    inverse.block<3, 3>(3 * static_cast<Index>(n), 3 * static_cast<Index>(n)) = blocks[n];
  }
  BraessSarazinSmoother<double> smoother(body.mesh, &constraints);
  smoother.set([&](std::size_t c) { return body.potential.dilatation(c); },
               [&](std::size_t c) { return body.potential.shared_hessian(c); });
  shape = columns_of(size, [&](const NodeVector& v, NodeVector& out) {
    out = k * v;
    smoother.subtract_product(v, out);
  });
  const auto largest_of = [](const MatrixXd& m) { return m.eigenvalues().real().maxCoeff(); };
  constexpr double of_shape = 0.6;
  const double weight = of_shape * largest_of(projection * inverse * projection * shape);
  for (Mat3& b : blocks) b /= weight;
  smoother.prepare(blocks);

  NodeVector r, d, space;
  const auto no_product = [](const NodeVector&, NodeVector&) {};
  MatrixXd m_inverse = columns_of(size, [&](const NodeVector& v, NodeVector& out) {
    smoother.smooth(no_product, projection * v, out, true, {r, d, space}, 1);
  });
  EXPECT_LT((m_inverse - m_inverse.transpose()).norm(), 1e-12 * m_inverse.norm());
  EXPECT_GT(
      Eigen::SelfAdjointEigenSolver<MatrixXd>(m_inverse + MatrixXd::Identity(size, size) - projection).eigenvalues()[0],
      0);
  // Changes of shape at most 1 / of_shape, of volume 1 + accuracy.
  const double largest = largest_of(m_inverse * projection * k * projection);
  EXPECT_LE(largest, std::max(1 / of_shape, 1 + BraessSarazinSmoother<double>::accuracy) * (1 + 1e-9));
  EXPECT_GT(largest, 1);
}

INSTANTIATE_TEST_SUITE_P(PoissonsRatios, BraessSarazinSmoothers, testing::Values(0.3, 0.49, 0.4999));

TEST(Multigrid, NearlyIncompressibleBodiesTakeFewMoreIterations) {
  // With block Jacobi 0.49 takes more than twice and 0.495 three times the iterations of 0.3.
  const auto iterations = [](double poisson, bool whole) {
    const Lattice lattice = one_material(
        {32, 20, 20}, {1, 1, 1},
        [&](const Index3& i) { return whole || Vec3(i[0] - 15.5, 1.4 * (i[1] - 9.5), 1.4 * (i[2] - 9.5)).norm() < 15; },
        100, poisson);
    Body body(lattice, 0, Elasticity::cauchy);
    const Hierarchy hierarchy(body.mesh, lattice.corner(), 300);
    const Constraints constraints(body.mesh, hold_nodes(
                                                 body.mesh, [](const Vec3& x) { return x[0] < 4 || x[0] > 28; },
                                                 [](const Vec3& x) { return Vec3(0, x[0] > 15 ? 2 : 0, 0); }));
    NewtonOptions options;
    options.tolerance = 1e-8;
    NodeVector u = NodeVector::Zero(static_cast<Index>(body.mesh.num_dofs()));
    const NewtonReport report = minimize(hierarchy, body.potential, constraints, options, u);
    EXPECT_TRUE(report.converged) << report.reason;
    return report.linear_iterations;
  };
  for (const bool whole : {false, true}) {
    const int usual = iterations(0.3, whole);
    EXPECT_LE(iterations(0.49, whole), 1.5 * usual);
    EXPECT_LE(iterations(0.495, whole), 2 * usual);
  }
}

TEST(Multigrid, IsPositiveForAThinBodyThatSinglePrecisionCannotTellFromALooseOne) {
  // A turn of a coil two voxels thick bends a million times as easily as it changes its volume.
  const auto axis = [](double x) {
    const double turn = 2 * std::numbers::pi * x / 60;
    return Vec3(x, 17.5 + 15 * std::cos(turn), 17.5 + 15 * std::sin(turn));
  };
  const Lattice lattice = one_material(
      {60, 36, 36}, {1, 1, 1},
      [&](const Index3& i) {
        double distance = 2;
        for (double x = i[0] - 2; x <= i[0] + 2; x += 0.1)
          distance = std::min(distance, (Vec3(i[0], i[1], i[2]) - axis(x)).norm());
        return distance <= 1.2;
      },
      20, 0.4999);
  const Body body(lattice, 0, Elasticity::cauchy);
  const Constraints constraints(
      body.mesh, hold_nodes(
                     body.mesh, [](const Vec3& x) { return x[0] < 2; }, [](const Vec3&) { return Vec3::Zero(); }));
  const Hierarchy hierarchy(body.mesh, lattice.corner(), 300);
  ASSERT_FALSE(hierarchy.in_double);
  EXPECT_TRUE(Multigrid(hierarchy, body.potential, constraints).is_positive());
}

}  // namespace test_braess_sarazin
