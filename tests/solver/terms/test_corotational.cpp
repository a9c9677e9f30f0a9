// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "solver/terms/large_deformation.h"
#include "terms/corotational.h"
#include "terms/make_elastic_cells.h"

namespace test_corotational {

using namespace hexsolver;
using namespace testing_support;

TEST(Elastic, TheProjectedHessianIsPositiveSemidefinite) {
  const Lattice lattice = bitten_ball({1, 1, 1});
  Body body(lattice, 1, Elasticity::corotational);
  // Strong compression makes the exact Hessian of some cells indefinite.
  const NodeVector u =
      sample(body.mesh, [](const Vec3& x) -> Vec3 { return -0.5 * x; }) + noise(body.mesh.num_dofs(), 0.4, 5);
  double most_negative_exact = 0;
  body.potential.linearize(u, Hessian::exact);
  for (std::size_t c = 0; c < body.mesh.num_cells(); ++c) {
    const CellMatrix h = body.potential.cell_hessian(c);
    most_negative_exact =
        std::min(most_negative_exact, Eigen::SelfAdjointEigenSolver<CellMatrix>(h).eigenvalues()[0] / h.norm());
  }
  EXPECT_LT(most_negative_exact, -1e-3);
  body.potential.linearize(u, Hessian::projected);
  for (std::size_t c = 0; c < body.mesh.num_cells(); ++c) {
    const CellMatrix h = body.potential.cell_hessian(c);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<CellMatrix>(h).eigenvalues()[0], -1e-12 * h.norm());
  }
}

TEST(Elastic, TheProjectedHessianTakesNothingAwayAndAddsLittle) {
  // The exact Hessian and what is added are E's: E+ >= E, and no larger than needed by more than a part.
  const Lattice lattice = bitten_ball({1, 1, 1});
  for (const double squeeze : {-0.5, -0.1, 0.3}) {
    Body body(lattice, 1, Elasticity::corotational);
    const NodeVector u =
        sample(body.mesh, [&](const Vec3& x) -> Vec3 { return squeeze * x; }) + noise(body.mesh.num_dofs(), 0.4, 5);
    std::vector<CellMatrix> exact;
    body.potential.linearize(u, Hessian::exact);
    for (std::size_t c = 0; c < body.mesh.num_cells(); ++c) exact.push_back(body.potential.cell_hessian(c));
    body.potential.linearize(u, Hessian::without_stress);
    double added = 0, needed = 0;
    std::vector<CellMatrix> bare;
    for (std::size_t c = 0; c < body.mesh.num_cells(); ++c) bare.push_back(body.potential.cell_hessian(c));
    body.potential.linearize(u, Hessian::projected);
    for (std::size_t c = 0; c < body.mesh.num_cells(); ++c) {
      const CellMatrix projected = body.potential.cell_hessian(c), stress = exact[c] - bare[c];
      // The positive part is kept in single precision.
      EXPECT_GT(Eigen::SelfAdjointEigenSolver<CellMatrix>(projected - exact[c]).eigenvalues()[0],
                -1e-6 * stress.norm());
      added += (projected - bare[c]).trace();
      needed += Eigen::SelfAdjointEigenSolver<CellMatrix>(stress).eigenvalues().cwiseMax(0).sum();
    }
    EXPECT_GT(added, 0.999999 * needed);
    EXPECT_LT(added, 1.25 * needed);
  }
}

TEST(Elastic, SavingMemoryChangesNothingButWhatIsKept) {
  const Lattice lattice = bitten_ball({1, 1, 1});
  const Body body(lattice, 1, Elasticity::corotational);
  const NodeVector u = large_deformation(body.mesh, 0.05), direction = noise(body.mesh.num_dofs(), 1, 33);
  for (const double projection : {Hessian::exact, Hessian::projected}) {
    std::array<NodeVector, 2> product, gradient;
    std::array<std::size_t, 2> bytes{};
    std::array<CellMatrix, 2> of_cell;
    for (const bool saves : {false, true}) {
      Potential potential(body.mesh);
      potential.add(make_elastic_cells(body.mesh, {lattice, 1}, {.saves_memory = saves}));
      potential.linearize(u, projection);
      potential.apply(direction, product[saves]);
      EXPECT_LT(error_of_single_precision(potential, direction), 1e-6);
      NodeVector magnitude;
      potential.gradient(u, gradient[saves], magnitude);
      of_cell[saves] = potential.cell_hessian(3);
      bytes[saves] = potential.costs()[0].bytes;
    }
    EXPECT_EQ(product[0], product[1]);
    EXPECT_LT((of_cell[0] - of_cell[1]).norm(), 1e-13 * of_cell[0].norm());
    EXPECT_LT((gradient[0] - gradient[1]).norm(), 1e-13 * gradient[0].norm());
    EXPECT_EQ(bytes[0] - bytes[1], body.mesh.batches().size() * sizeof(RotatedCells<double>));
  }
}

TEST(Elastic, CellsSideBySideRotateAsEachAlone) {
  const Lattice lattice = box({19, 3, 2}, {1, 1, 2});
  const Body body(lattice, 0, Elasticity::corotational);
  // Cells stretched, crushed flat, mirrored, turned over and left as they are, next to each other.
  NodeVector u = large_deformation(body.mesh, 0.2);
  for (std::size_t n = 0; n < body.mesh.num_nodes(); ++n) {
    const Index3& at = body.mesh.nodes()[n];
    const auto x = static_cast<Eigen::Index>(3 * n);
    if (at[0] == 5) u[x] += 1;
    if (at[0] == 9) u[x] += 1.7;
    if (at[0] == 13) u.segment<3>(x) += Vec3(-2.5, 0.3, 0.1);
    if (at[0] > 15) u.segment<3>(x).setZero();
  }
  double least = 1;
  for (std::size_t c = 0; c < body.mesh.num_cells(); ++c) least = std::min(least, body.elastic->jacobians(c, u).least);
  EXPECT_LT(least, -0.2);

  const auto some_turn = [](std::size_t cell) { return cell % 3 != 0; };
  for (const bool all : {true, false}) {
    ElasticSettings settings;
    if (!all)
      for (std::size_t c = 0; c < body.mesh.num_cells(); ++c) settings.rotating.push_back(some_turn(c));
    const auto cells = make_elastic_cells(body.mesh, {lattice, 0}, settings);
    NodeVector of_each = NodeVector::Zero(u.size()), of_frames = of_each, magnitude = of_each;
    double energy = 0;
    for (std::size_t c = 0; c < body.mesh.num_cells(); ++c) energy += cells->cell_energy(c, u);
    cells->add_gradient(u, of_each, magnitude);
    cells->move_to(u);
    cells->add_gradient(u, of_frames, magnitude);
    EXPECT_NEAR(cells->energy(u), energy, 1e-13 * energy);
    EXPECT_LT((of_frames - of_each).norm(), 1e-13 * of_each.norm());

    // Those that save memory find the frame of each alone for its Hessian.
    settings.saves_memory = true;
    const auto alone = make_elastic_cells(body.mesh, {lattice, 0}, settings);
    const NodeVector x = noise(body.mesh.num_dofs(), 1, 22);
    for (const double projection : {Hessian::exact, Hessian::projected}) {
      cells->linearize(u, projection);
      alone->linearize(u, projection);
      NodeVector product = NodeVector::Zero(u.size()), sum = product;
      cells->add_product(x, product);
      for (std::size_t c = 0; c < body.mesh.num_cells(); ++c) {
        CellMatrix h = CellMatrix::Zero();
        alone->add_cell_hessian(c, h);
        body.mesh.scatter_add(c, h * body.mesh.gather(c, x), sum);
      }
      EXPECT_LT((product - sum).norm(), 1e-7 * sum.norm());  // B and C are in single precision
    }
  }
}

TEST(Elastic, WhatIsKeptIsThatOfTheState) {
  const Lattice lattice = bitten_ball({1, 1, 1});
  const Body body(lattice, 1, Elasticity::corotational);
  const NodeVector u = large_deformation(body.mesh, 0.05), elsewhere = 0.5 * u, x = noise(body.mesh.num_dofs(), 1, 22);
  std::vector<bool> rotating(body.mesh.num_cells());
  for (std::size_t c = 0; c < rotating.size(); ++c) rotating[c] = c % 2 == 0;
  for (const bool saves : {false, true}) {
    const ElasticSettings settings{.saves_memory = saves};
    const auto used = make_elastic_cells(body.mesh, {lattice, 1}, settings);
    const auto expect_as_new = [&](double projection, const std::vector<bool>& which) {
      ElasticSettings of_new = settings;
      of_new.rotating = which;
      const auto anew = make_elastic_cells(body.mesh, {lattice, 1}, of_new);
      used->linearize(u, projection);
      anew->linearize(u, projection);
      NodeVector product = NodeVector::Zero(u.size()), expected = product;
      FloatNodeVector single = FloatNodeVector::Zero(u.size()), expected_single = single;
      used->add_product(x, product);
      anew->add_product(x, expected);
      used->add_product(x.cast<float>(), single);
      anew->add_product(x.cast<float>(), expected_single);
      EXPECT_EQ(product, expected) << projection;
      EXPECT_EQ(single, expected_single) << projection;
    };
    expect_as_new(Hessian::projected, {});
    used->move_to(elsewhere);
    expect_as_new(Hessian::projected, {});
    expect_as_new(Hessian::exact, {});
    expect_as_new(Hessian::without_stress, {});
    expect_as_new(Hessian::exact, {});
    used->linearize(elsewhere, Hessian::projected);
    expect_as_new(Hessian::without_stress, {});
    expect_as_new(Hessian::exact, {});
    dynamic_cast<CorotationalCells&>(*used).set_rotating(rotating);
    expect_as_new(Hessian::projected, rotating);
  }
}

TEST(Elastic, CellsThatKeepARotationHaveItsEnergyAndItsForces) {
  // Cells half of which are turned inside out: two singular values of these sum to nothing.
  const Lattice lattice = bitten_ball({1, 1, 1});
  const Body body(lattice, 1, Elasticity::corotational);
  CorotationalCells cells(*body.elastic);
  const double middle = (body.mesh.position(0)[0] + body.mesh.position(body.mesh.num_nodes() - 1)[0]) / 2;
  NodeVector u = sample(body.mesh, [&](const Vec3& p) {
    return p[0] > middle ? Vec3(0.5 * p[0], -0.3 * p[1], -1.7 * p[2]) : Vec3(0.1 * p[1], 0, 0);
  });
  u += noise(body.mesh.num_dofs(), 1e-3, 5);
  const double before = cells.energy(u);
  cells.hold_rotations(u, nullptr, 0.25);
  const std::size_t held = cells.num_held();
  EXPECT_GT(held, 0U);
  EXPECT_LT(held, body.mesh.num_cells());
  EXPECT_NEAR(cells.energy(u), before, 1e-12 * before) << "of the state that they are held at";

  const NodeVector direction = noise(body.mesh.num_dofs(), 1, 9);
  const auto gradient = [&](const NodeVector& at) {
    NodeVector g = NodeVector::Zero(at.size()), sizes = g;
    cells.add_gradient(at, g, sizes);
    return g;
  };
  const NodeVector near = u + 1e-2 * direction;  // where the rotations of the cells held would be others
  const double h = 1e-6;
  const double slope = (cells.energy(near + h * direction) - cells.energy(near - h * direction)) / (2 * h);
  EXPECT_NEAR(gradient(near).dot(direction), slope, 1e-7 * std::abs(slope));
  for (const bool at_state : {false, true}) {
    if (at_state) cells.move_to(near);
    EXPECT_NEAR(gradient(near).dot(direction), slope, 1e-7 * std::abs(slope)) << at_state;
  }
  const NodeVector change = (gradient(near + h * direction) - gradient(near - h * direction)) / (2 * h);
  NodeVector product = NodeVector::Zero(u.size()), by_cells = product;
  cells.linearize(near, Hessian::exact);
  cells.add_product(direction, product);
  EXPECT_LT((product - change).norm(), 1e-6 * change.norm());
  for (std::size_t c = 0; c < body.mesh.num_cells(); ++c) {
    CellMatrix hessian = CellMatrix::Zero();
    cells.add_cell_hessian(c, hessian);
    body.mesh.scatter_add(c, hessian * body.mesh.gather(c, direction), by_cells);
    EXPECT_EQ(cells.shared_hessian(c), Term::own_hessian);
  }
  EXPECT_LT((by_cells - product).norm(), 1e-12 * product.norm());

  const NodeVector zero = NodeVector::Zero(u.size());
  cells.hold_rotations(zero, &zero, 0.25);
  EXPECT_EQ(cells.num_held(), held) << "of a step that is tried again none is let go";
  cells.hold_rotations(zero, nullptr, 0.25);
  EXPECT_EQ(cells.num_held(), 0U);
  NodeVector rotating = NodeVector::Zero(u.size()), sizes = rotating;
  CorotationalCells(*body.elastic).add_gradient(near, rotating, sizes);
  EXPECT_EQ(gradient(near), rotating);
}

TEST(Elastic, BothHessiansAgreeWithCauchyAtRest) {
  const Lattice lattice = bitten_ball({1, 1, 1});
  Body linear(lattice, 1, Elasticity::cauchy), rotated(lattice, 1, Elasticity::corotational);
  const NodeVector zero = NodeVector::Zero(static_cast<Eigen::Index>(linear.mesh.num_dofs()));
  const NodeVector v = noise(linear.mesh.num_dofs(), 1, 3);
  NodeVector expected, found;
  linear.potential.apply(v, expected);
  for (const double projection : {Hessian::exact, Hessian::projected}) {
    rotated.potential.linearize(zero, projection);
    rotated.potential.apply(v, found);
    EXPECT_LT((found - expected).norm(), 1e-12 * expected.norm());
  }
}

TEST(Elastic, ASmallDeformationAfterALargeRotationStoresTheLinearEnergy) {
  const Lattice lattice = bitten_ball({1, 1, 1});
  const Body linear(lattice, 1, Elasticity::cauchy), rotated(lattice, 1, Elasticity::corotational);
  const Mat3 r = random_rotation(31);
  const NodeVector small = noise(linear.mesh.num_dofs(), 1e-7, 9);
  NodeVector turned = small;
  for (std::size_t n = 0; n < linear.mesh.num_nodes(); ++n) {
    const Eigen::Index at = 3 * static_cast<Eigen::Index>(n);
    const Vec3 x = linear.mesh.position(n);
    turned.segment<3>(at) = r * (x + small.segment<3>(at)) - x;
  }
  // The two differ by the rotation within the small deformation, of relative size 1e-7 / cell size.
  EXPECT_NEAR(rotated.potential.energy(turned), rotated.potential.energy(small), 1e-6 * linear.potential.energy(small));
}

TEST(Elastic, OnlyTheChosenCellsRotate) {
  const Lattice lattice = bitten_ball({1, 1, 2.5}, {0, 1, 0});
  const Mesh mesh(lattice.levels[1].cells, lattice.cell_edges(1), lattice.corner());
  std::vector<bool> rotating(mesh.num_cells()), none(mesh.num_cells());
  for (std::size_t c = 0; c < rotating.size(); ++c) rotating[c] = mesh.cells()[c][0] % 2 == 0;
  const auto cells = [&](Elasticity elasticity, const std::vector<bool>& which) {
    auto potential = std::make_unique<Potential>(mesh);
    potential->add(make_elastic_cells(mesh, {lattice, 1}, {.elasticity = elasticity, .rotating = which}));
    return potential;
  };
  const auto some = cells(Elasticity::corotational, rotating), no = cells(Elasticity::corotational, none),
             all = cells(Elasticity::corotational, {}), linear = cells(Elasticity::cauchy, {});
  const NodeVector u = large_deformation(mesh, 0.05), direction = noise(mesh.num_dofs(), 1, 33);
  const auto gradient = [](const Potential& p, const NodeVector& at) {
    NodeVector g, magnitude;
    p.gradient(at, g, magnitude);
    return g;
  };
  EXPECT_LT((gradient(*no, u) - gradient(*linear, u)).norm(), 1e-12 * gradient(*linear, u).norm());
  constexpr double h = 1e-5;
  const double measured = (some->energy(u + h * direction) - some->energy(u - h * direction)) / (2 * h);
  EXPECT_NEAR(gradient(*some, u).dot(direction), measured, 1e-6 * gradient(*some, u).norm() * direction.norm());
  for (Potential* p : {some.get(), all.get(), linear.get()}) p->linearize(u, Hessian::exact);
  NodeVector product;
  some->apply(direction, product);
  const NodeVector difference = (gradient(*some, u + h * direction) - gradient(*some, u - h * direction)) / (2 * h);
  EXPECT_LT((product - difference).norm(), 1e-6 * product.norm());
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const CellMatrix expected = (rotating[c] ? all : linear)->cell_hessian(c);
    EXPECT_LT((some->cell_hessian(c) - expected).norm(), 1e-12 * expected.norm());
    EXPECT_EQ(some->shared_hessian(c), rotating[c] ? Term::own_hessian : linear->shared_hessian(c));
  }
}

}  // namespace test_corotational
