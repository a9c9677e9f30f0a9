// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "hexsolver/dead_load.h"
#include "hexsolver/elastic.h"
#include "hexsolver/ground_springs.h"
#include "hexsolver/inertia.h"
#include "hexsolver/viscosity.h"
#include "support/bodies.h"

using namespace hexsolver;
using namespace testing_support;

namespace {

/// A rotated, twisted and shaken state of a body, far from rest and without inverted cells.
NodeVector large_deformation(const Mesh& mesh, double roughness) {
  const Mat3 r = random_rotation(12);
  NodeVector u = sample(mesh, [&](const Vec3& x) -> Vec3 {
    const Vec3 q = x - Vec3(15, -14, 36);
    const Vec3 stretched(1.3 * q[0] + 0.01 * q[1] * q[2], 0.8 * q[1], 0.9 * q[2] + 0.02 * q[0] * q[0]);
    return r * stretched - q;
  });
  return u + noise(mesh.num_dofs(), roughness, 21);
}

class ElasticLevels : public testing::TestWithParam<std::tuple<int, Elasticity, Volumetric>> {
protected:
  const Lattice lattice = bitten_ball({1, 1, 2.5}, {0, 1, 0}, random_rotation(13));
  Body body{lattice, std::get<0>(GetParam()), std::get<1>(GetParam()), std::get<2>(GetParam())};
  const NodeVector u = large_deformation(body.mesh, 0.05);
  const NodeVector direction = noise(body.mesh.num_dofs(), 1, 33);
  const bool turns = std::get<1>(GetParam()) != Elasticity::cauchy;
  /// Cells of large strain keep their Hessians in single precision.
  const double precision = is_hyperelastic(std::get<1>(GetParam())) ? 1e-6 : 1e-11;

  NodeVector gradient(const NodeVector& at) const {
    NodeVector g, magnitude;
    body.potential.gradient(at, g, magnitude);
    return g;
  }
};

}  // namespace

TEST_P(ElasticLevels, GradientMatchesTheDifferenceOfEnergies) {
  constexpr double h = 1e-5;
  const double measured =
      (body.potential.energy(u + h * direction) - body.potential.energy(u - h * direction)) / (2 * h);
  const double claimed = gradient(u).dot(direction);
  // Truncation h^2 and rounding eps W / h, both near 1e-9 of the scale.
  EXPECT_NEAR(claimed, measured, 1e-6 * gradient(u).norm() * direction.norm());
}

TEST_P(ElasticLevels, HessianMatchesTheDifferenceOfGradients) {
  constexpr double h = 1e-5;
  body.potential.linearize(u, Hessian::exact);
  NodeVector claimed;
  body.potential.apply(direction, claimed);
  const NodeVector measured = (gradient(u + h * direction) - gradient(u - h * direction)) / (2 * h);
  EXPECT_LT((claimed - measured).norm(), 1e-6 * claimed.norm());
}

TEST_P(ElasticLevels, CellHessiansAddUpToTheOperator) {
  for (const double clamping : {Hessian::exact, Hessian::clamped}) {
    body.potential.linearize(u, clamping);
    NodeVector applied, added = NodeVector::Zero(direction.size());
    body.potential.apply(direction, applied);
    for (std::size_t c = 0; c < body.mesh.num_cells(); ++c) {
      const CellMatrix h = body.potential.cell_hessian(c);
      EXPECT_LT((h - h.transpose()).norm(), precision * h.norm());
      body.mesh.scatter_add(c, h * body.mesh.gather(c, direction), added);
    }
    EXPECT_LT((applied - added).norm(), precision * applied.norm());
  }
}

TEST_P(ElasticLevels, SinglePrecisionIsOffByItsRounding) {
  for (const double clamping : {Hessian::exact, Hessian::clamped}) {
    body.potential.linearize(u, clamping);
    EXPECT_LT(error_of_single_precision(body.potential, direction), 1e-6);  // 2^-24 times some ten
  }
  body.potential.linearize(u + 0.01 * direction, Hessian::exact);  // copies do not outlive a state
  EXPECT_LT(error_of_single_precision(body.potential, direction), 1e-6);
}

TEST_P(ElasticLevels, ARigidMotionGivesNoForce) {
  const Mat3 r = random_rotation(17);
  const NodeVector moved = sample(body.mesh, [&](const Vec3& x) -> Vec3 {
    return turns ? Vec3(r * x - x + Vec3(4, 5, 6)) : Vec3(Vec3(0.1, 0.2, 0.3).cross(x) + Vec3(4, 5, 6));
  });
  NodeVector g, magnitude, scale, ignored;
  body.potential.gradient(moved, g, magnitude);
  body.potential.gradient(u, ignored, scale);
  EXPECT_LT(g.norm(), 1e-11 * scale.norm());
}

TEST_P(ElasticLevels, WhatResistsChangeOfVolumeIsAllThatResistsSwelling) {
  const Mat3 r = turns ? random_rotation(17) : Mat3(Mat3::Identity());
  body.potential.linearize(sample(body.mesh, [&](const Vec3& x) -> Vec3 { return r * x - x; }), Hessian::exact);
  const NodeVector swelling = sample(body.mesh, [&](const Vec3& x) -> Vec3 { return r * x; });
  const bool tells = std::get<2>(GetParam()) == Volumetric::mean && !is_hyperelastic(std::get<1>(GetParam()));
  for (std::size_t c = 0; c < body.mesh.num_cells(); ++c) {
    const Dilatation d = body.potential.dilatation(c);
    EXPECT_EQ(d.bulk > 0, tells);
    if (!tells) continue;
    const CellVector v = body.mesh.gather(c, swelling);
    const CellMatrix k = body.potential.cell_hessian(c);
    EXPECT_NEAR(d.divergence.dot(v), 3 * d.volume, 1e-12 * v.norm() * d.divergence.norm());
    EXPECT_LT(((k - d.hessian()) * v).norm(), 1e-11 * k.norm() * v.norm());
  }
}

TEST_P(ElasticLevels, ForcesHaveNoResultantAndThoseOfCellsThatTurnNoTorque) {
  NodeVector g, magnitude;
  body.potential.gradient(u, g, magnitude);
  Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
  for (std::size_t n = 0; n < body.mesh.num_nodes(); ++n) {
    const Vec3 f = g.segment<3>(3 * static_cast<Eigen::Index>(n));
    force += f;
    torque += Vec3(body.mesh.position(n) + u.segment<3>(3 * static_cast<Eigen::Index>(n))).cross(f);
  }
  EXPECT_LT(force.norm(), 1e-11 * magnitude.sum());
  if (turns) {
    EXPECT_LT(torque.norm(), 1e-11 * 40 * magnitude.sum());  // lever arms of up to 40 mm
  }
}

INSTANTIATE_TEST_SUITE_P(All, ElasticLevels,
                         testing::Combine(testing::Values(0, 1, 2),
                                          testing::Values(Elasticity::cauchy, Elasticity::corotational),
                                          testing::Values(Volumetric::mean, Volumetric::full)));
INSTANTIATE_TEST_SUITE_P(GreenLagrange, ElasticLevels,
                         testing::Combine(testing::Values(0, 1, 2), testing::Values(Elasticity::green_lagrange),
                                          testing::Values(Volumetric::full)));
INSTANTIATE_TEST_SUITE_P(NeoHookean, ElasticLevels,
                         testing::Combine(testing::Values(0, 1, 2),
                                          testing::Values(Elasticity::neo_hookean, Elasticity::stable_neo_hookean),
                                          testing::Values(Volumetric::mean, Volumetric::full)));

TEST(Elastic, TheClampedHessianIsPositiveSemidefinite) {
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
  body.potential.linearize(u, Hessian::clamped);
  for (std::size_t c = 0; c < body.mesh.num_cells(); ++c) {
    const CellMatrix h = body.potential.cell_hessian(c);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<CellMatrix>(h).eigenvalues()[0], -1e-12 * h.norm());
  }
}

TEST(Elastic, TheClampedHessianTakesNothingAwayAndAddsLittle) {
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
    body.potential.linearize(u, Hessian::clamped);
    for (std::size_t c = 0; c < body.mesh.num_cells(); ++c) {
      const CellMatrix clamped = body.potential.cell_hessian(c), stress = exact[c] - bare[c];
      // The positive part is kept in single precision.
      EXPECT_GT(Eigen::SelfAdjointEigenSolver<CellMatrix>(clamped - exact[c]).eigenvalues()[0], -1e-6 * stress.norm());
      added += (clamped - bare[c]).trace();
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
  for (const double clamping : {Hessian::exact, Hessian::clamped}) {
    std::array<NodeVector, 2> product, gradient;
    std::array<std::size_t, 2> bytes{};
    std::array<CellMatrix, 2> of_cell;
    for (const bool saves : {false, true}) {
      Potential potential(body.mesh);
      potential.add(make_elastic_cells(body.mesh, lattice, 1, {.saves_memory = saves}));
      potential.linearize(u, clamping);
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
    EXPECT_EQ(bytes[0] - bytes[1], body.mesh.batches().size() * sizeof(TurnedCells<double>));
  }
}

TEST(Elastic, CellsSideBySideTurnAsEachAlone) {
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
  for (std::size_t c = 0; c < body.mesh.num_cells(); ++c) least = std::min(least, body.elastic->least_jacobian(c, u));
  EXPECT_LT(least, -0.2);

  const auto some_turn = [](std::size_t cell) { return cell % 3 != 0; };
  for (const bool all : {true, false}) {
    ElasticSettings settings;
    if (!all)
      for (std::size_t c = 0; c < body.mesh.num_cells(); ++c) settings.turning.push_back(some_turn(c));
    const auto cells = make_elastic_cells(body.mesh, lattice, 0, settings);
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
    const auto alone = make_elastic_cells(body.mesh, lattice, 0, settings);
    const NodeVector x = noise(body.mesh.num_dofs(), 1, 22);
    for (const double clamping : {Hessian::exact, Hessian::clamped}) {
      cells->linearize(u, clamping);
      alone->linearize(u, clamping);
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
  std::vector<bool> turning(body.mesh.num_cells());
  for (std::size_t c = 0; c < turning.size(); ++c) turning[c] = c % 2 == 0;
  for (const bool saves : {false, true}) {
    const ElasticSettings settings{.saves_memory = saves};
    const auto used = make_elastic_cells(body.mesh, lattice, 1, settings);
    const auto expect_as_new = [&](double clamping, const std::vector<bool>& which) {
      ElasticSettings of_new = settings;
      of_new.turning = which;
      const auto anew = make_elastic_cells(body.mesh, lattice, 1, of_new);
      used->linearize(u, clamping);
      anew->linearize(u, clamping);
      NodeVector product = NodeVector::Zero(u.size()), expected = product;
      FloatNodeVector single = FloatNodeVector::Zero(u.size()), expected_single = single;
      used->add_product(x, product);
      anew->add_product(x, expected);
      used->add_product(x.cast<float>(), single);
      anew->add_product(x.cast<float>(), expected_single);
      EXPECT_EQ(product, expected) << clamping;
      EXPECT_EQ(single, expected_single) << clamping;
    };
    expect_as_new(Hessian::clamped, {});
    used->move_to(elsewhere);
    expect_as_new(Hessian::clamped, {});
    expect_as_new(Hessian::exact, {});
    expect_as_new(Hessian::without_stress, {});
    expect_as_new(Hessian::exact, {});
    used->linearize(elsewhere, Hessian::clamped);
    expect_as_new(Hessian::without_stress, {});
    expect_as_new(Hessian::exact, {});
    dynamic_cast<CorotationalCells&>(*used).set_turning(turning);
    expect_as_new(Hessian::clamped, turning);
  }
}

TEST(Elastic, BothHessiansAgreeWithCauchyAtRest) {
  const Lattice lattice = bitten_ball({1, 1, 1});
  Body linear(lattice, 1, Elasticity::cauchy), rotated(lattice, 1, Elasticity::corotational);
  const NodeVector zero = NodeVector::Zero(static_cast<Eigen::Index>(linear.mesh.num_dofs()));
  const NodeVector v = noise(linear.mesh.num_dofs(), 1, 3);
  NodeVector expected, found;
  linear.potential.apply(v, expected);
  for (const double clamping : {Hessian::exact, Hessian::clamped}) {
    rotated.potential.linearize(zero, clamping);
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

TEST(Elastic, OnlyTheChosenCellsTurn) {
  const Lattice lattice = bitten_ball({1, 1, 2.5}, {0, 1, 0});
  const Mesh mesh(lattice.levels[1].cells, lattice.cell_edges(1), lattice.corner());
  std::vector<bool> turning(mesh.num_cells()), none(mesh.num_cells());
  for (std::size_t c = 0; c < turning.size(); ++c) turning[c] = mesh.cells()[c][0] % 2 == 0;
  const auto cells = [&](Elasticity elasticity, const std::vector<bool>& which) {
    auto potential = std::make_unique<Potential>(mesh);
    potential->add(make_elastic_cells(mesh, lattice, 1, {.elasticity = elasticity, .turning = which}));
    return potential;
  };
  const auto some = cells(Elasticity::corotational, turning), no = cells(Elasticity::corotational, none),
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
    const CellMatrix expected = (turning[c] ? all : linear)->cell_hessian(c);
    EXPECT_LT((some->cell_hessian(c) - expected).norm(), 1e-12 * expected.norm());
    EXPECT_EQ(some->shared_hessian(c), turning[c] ? Term::own_hessian : linear->shared_hessian(c));
  }
}

TEST(EdgeRotatedCells, ForcesAreTheLinearOnesInTheFrameOfTheEdges) {
  // A turned and slightly strained body: R K R^T (x - R X), R the rotation of the edges.
  const Lattice lattice = bitten_ball({1, 1, 2.5}, {0, 1, 0}, random_rotation(13));
  Body turning(lattice, 1, Elasticity::corotational, Volumetric::mean, Rotation::edges);
  const Body linear(lattice, 1, Elasticity::cauchy);
  EXPECT_FALSE(turning.potential.is_conservative());
  const Mat3 r = random_rotation(17);
  Mat3 upper;  // keeps the first edge and the plane of the first two: Gram-Schmidt gives R back
  upper << 1.02, 0.01, -0.02, 0, 0.97, 0.03, 0, 0, 1.01;
  const Mat3 axes = lattice.voxels.direction();
  const Mat3 strained = axes * upper * axes.transpose();
  const NodeVector moved = sample(turning.mesh, [&](const Vec3& x) -> Vec3 { return r * strained * x - x; });
  const NodeVector stretched = sample(turning.mesh, [&](const Vec3& x) -> Vec3 { return strained * x - x; });
  NodeVector g, expected, magnitude;
  linear.potential.gradient(stretched, expected, magnitude);
  turning.potential.gradient(moved, g, magnitude);
  for (std::size_t n = 0; n < turning.mesh.num_nodes(); ++n) {
    const auto at = 3 * static_cast<Eigen::Index>(n);
    EXPECT_LT((g.segment<3>(at) - r * expected.segment<3>(at)).norm(), 1e-11 * magnitude.norm());
  }
  EXPECT_NEAR(turning.potential.energy(moved), linear.potential.energy(stretched),
              1e-10 * linear.potential.energy(stretched));
}

TEST(EdgeRotatedCells, CellHessiansAddUpToTheOperator) {
  Body body(bitten_ball({1, 1, 1}), 1, Elasticity::corotational, Volumetric::mean, Rotation::edges);
  const NodeVector u = large_deformation(body.mesh, 0.05), direction = noise(body.mesh.num_dofs(), 1, 33);
  body.potential.linearize(u, Hessian::exact);
  NodeVector applied, added = NodeVector::Zero(direction.size());
  body.potential.apply(direction, applied);
  for (std::size_t c = 0; c < body.mesh.num_cells(); ++c)
    body.mesh.scatter_add(c, body.potential.cell_hessian(c) * body.mesh.gather(c, direction), added);
  EXPECT_LT((applied - added).norm(), 1e-11 * applied.norm());
  EXPECT_LT(error_of_single_precision(body.potential, direction), 1e-6);
}

TEST(Potential, InSinglePrecisionEachTermIsOffByItsRounding) {
  const Lattice lattice = bitten_ball({1, 1, 1});
  const Body body(lattice, 1, Elasticity::corotational);
  const std::vector<std::int32_t>& element = lattice.levels[1].element;
  const NodeVector u = large_deformation(body.mesh, 0.05), direction = noise(body.mesh.num_dofs(), 1, 33);
  const auto expect_of = [&](std::unique_ptr<Term> term) {
    Potential potential(body.mesh);
    potential.add(std::move(term));
    potential.linearize(u, Hessian::exact);
    EXPECT_LT(error_of_single_precision(potential, direction), 1e-6);
    NodeVector product, before, after, magnitude;  // of energies that are quadratic
    potential.apply(direction, product);
    potential.gradient(u, before, magnitude);
    potential.gradient(u + direction, after, magnitude);
    EXPECT_LT((after - before - product).norm(), 1e-11 * magnitude.norm());
  };
  auto inertia = std::make_unique<Inertia>(body.mesh, element, lumped_masses(lattice, 1), 0.5);
  inertia->set_step(u, direction, 0.01);
  expect_of(std::move(inertia));
  auto viscosity = std::make_unique<Viscosity>(*body.elastic, 0.1);
  viscosity->set_step(u, 0.01);
  expect_of(std::move(viscosity));
  expect_of(
      std::make_unique<GroundSprings>(body.mesh, std::vector<std::pair<std::int32_t, double>>{{2, 3.0}, {5, 1.0}}));
}

TEST(Potential, IsTheSumOfItsTermsAndOfTheFractionOfTheLoads) {
  const Lattice lattice = bitten_ball({1, 1, 1});
  Body body(lattice, 1, Elasticity::corotational), alone(lattice, 1, Elasticity::corotational);
  const NodeVector u = large_deformation(body.mesh, 0.05), direction = noise(body.mesh.num_dofs(), 1, 33);
  auto load =
      std::make_unique<DeadLoad>("load", std::vector<DeadLoad::NodeForce>{{3, {0.1, -0.2, 0.3}}, {7, {1, 2, -3}}});
  load->set_factor({0.25, 0.25, 0.25});
  body.potential.add(std::move(load));
  NodeVector g, without, magnitude;
  body.potential.gradient(u, g, magnitude);
  alone.potential.gradient(u, without, magnitude);
  NodeVector expected = without;
  expected.segment<3>(9) -= 0.25 * Vec3(0.1, -0.2, 0.3);
  expected.segment<3>(21) -= 0.25 * Vec3(1, 2, -3);
  EXPECT_LT((g - expected).norm(), 1e-12 * magnitude.norm());
  constexpr double h = 1e-5;
  const double measured =
      (body.potential.energy(u + h * direction) - body.potential.energy(u - h * direction)) / (2 * h);
  EXPECT_NEAR(g.dot(direction), measured, 1e-6 * g.norm() * direction.norm());
}
