// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "hexsolver/scene/scene_files.h"
#include "solver/terms/large_deformation.h"
#include "support/solve.h"
#include "terms/make_elastic_cells.h"

namespace test_elastic {

using namespace hexsolver;
using namespace testing_support;

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
  for (const double clamping : {Hessian::exact, Hessian::projected}) {
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
  for (const double clamping : {Hessian::exact, Hessian::projected}) {
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

/// A rounded body that bends under its weight, cut at the nodes that are held: nothing is wrong but its cells.
TEST(CondensedCells, AreNearerToTheirVoxelsThanThePapers) {
  const auto volume = make_volume({56, 24, 24}, {1, 1, 1}, [](const Index3& v) {
    const Vec3 x = Vec3(v[0] - 8, v[1] - 11.3, v[2] - 12.2);
    return v[0] >= 8 && std::pow(x[0] / 47, 2) + std::pow(x[1] / 11, 2) + std::pow(x[2] / 9.5, 2) < 1 ? 1 : 0;
  });
  for (const double poisson : {0.3, 0.49}) {
    const Lattice lattice = hexmesh::build_lattice(
        volume, {{volume.segments[0], hexmesh::material_from_units(100, poisson, 1000), 0, ""}}, {5, {0, 0, 0}});
    const auto sinks = [&](const char* stiffness, int level) {
      SolveReport report;
      const hexmesh::Result result = solve_equilibrium(
          lattice,
          parse_scene(
              std::string(
                  "[solve]\nstrain = \"cauchy\"\nerror_estimate = \"off\"\nsupports = \"area\"\nstiffness = \"") +
                  stiffness + "\"\n[[fix]]\nbox_mm = [-1, 7.6, -1, 25, -1, 25]\n[gravity]\nm_s2 = [0, 0, -1]\n",
              "test", ""),
          level, report);
      return -displacement_inside(result, {Vec3(50, 11.3, 12.2)})[0][2];
    };
    const double exact = sinks("exact", 0);
    for (const auto& [level, part] : {std::pair(1, 0.5), {2, 0.75}})
      EXPECT_LT(std::abs(sinks("condensed", level) - exact), part * std::abs(sinks("exact", level) - exact))
          << "level " << level << ", Poisson's ratio " << poisson;
  }
}

/// Corners that hardly carry do not say how a cell turns: they did, and Newton's method took hundreds of steps.
TEST(CondensedCells, TurnWithTheirMaterial) {
  const Lattice lattice = bitten_ball({1, 1.2, 3}, {1, 2, 3}, random_rotation(5));
  const Mesh mesh = MeshCells(lattice, 2).make_mesh();
  const MeshCells cells(lattice, 2);
  const Scene scene = parse_scene("[solve]\nstiffness = \"condensed\"\n", "test", "");
  std::optional<hexmesh::Condensation> known;
  const auto elastic = make_elastic_cells(
      mesh, cells, elastic_settings(scene, Elasticity::corotational, {}, condense(cells, scene, {}, known)));
  int num_soft = 0;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const ElementModel& model = elastic->model(c);
    ASSERT_TRUE(model.condensed.has_value());
    Mat3 of_places = Mat3::Zero();
    double softest = std::numeric_limits<double>::infinity(), stiffest = 0, of_softest = 0;
    for (int a = 0; a < 8; ++a) {
      const Vec3 x =
          mesh.edges(c) * Vec3(hexmesh::corner_bit(a, 0), hexmesh::corner_bit(a, 1), hexmesh::corner_bit(a, 2));
      of_places += x * model.mean_gradient.row(a);
      const double k = model.stiffness.block<3, 3>(3 * a, 3 * a).trace();
      if (k < softest) of_softest = (mesh.edges(c).transpose() * model.mean_gradient.row(a).transpose()).norm();
      softest = std::min(softest, k);
      stiffest = std::max(stiffest, k);
    }
    EXPECT_LT((of_places - Mat3::Identity()).norm(), 1e-10) << "linear fields have their gradient";
    EXPECT_LT(model.mean_gradient.colwise().sum().norm() * mesh.edges(c).norm(), 1e-10);
    if (softest < 1e-3 * stiffest) {
      EXPECT_LT(of_softest, 0.1) << "cell " << c;
      ++num_soft;
    }
  }
  EXPECT_GT(num_soft, 5);
}

/// A multigrid takes this part out of a Hessian and smooths the rest, which is to be positive: it was not in cells that
/// turn, and Newton's method ended on nearly incompressible lungs.
TEST(CondensedCells, ResistChangeOfVolumeAsTheySayWhereTheyTurn) {
  const auto volume = make_volume({24, 24, 24}, {1, 1, 1}, [](const Index3& v) {
    return Vec3(v[0] - 11.3, v[1] - 12.2, v[2] - 10.9).norm() < 9.7 ? 1 : 0;
  });
  const Lattice lattice = hexmesh::build_lattice(
      volume, {{volume.segments[0], hexmesh::material_from_units(100, 0.4999, 1000), 0, ""}}, {4, {0, 0, 0}});
  const Scene scene = parse_scene("[solve]\nstiffness = \"condensed\"\n", "test", "");
  for (const int level : {1, 2}) {
    const MeshCells cells(lattice, level);
    const Mesh mesh = cells.make_mesh();
    std::optional<hexmesh::Condensation> known;
    const auto elastic = make_elastic_cells(
        mesh, cells, elastic_settings(scene, Elasticity::corotational, {}, condense(cells, scene, {}, known)));
    elastic->linearize(large_deformation(mesh, 0.05), Hessian::projected);
    for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
      CellMatrix h = CellMatrix::Zero();
      elastic->add_cell_hessian(c, h);
      const CellMatrix rest = h - elastic->dilatation(c).hessian();
      const Eigen::SelfAdjointEigenSolver<CellMatrix> eigen(rest, Eigen::EigenvaluesOnly);
      EXPECT_GT(eigen.eigenvalues()[0], -1e-6 * eigen.eigenvalues()[23]) << "cell " << c << " of level " << level;
      EXPECT_LT(rest.norm(), 0.5 * h.norm()) << "hardly compressible";
    }
  }
}

/// A bar one or two cells thick that bends under its weight. Trilinear cells shear where they should bend.
TEST(IncompatibleModes, CellsBendAsTheirVoxelsDo) {
  for (const auto& [strain, gravity, volumetric] :
       {std::tuple("cauchy", "0.5", "full"), {"corotational", "4", "full"}, {"cauchy", "0.5", "mean"}}) {
    const auto volume = make_volume({64, 16, 16}, {1, 1, 1}, [](const Index3&) { return 1; });
    const Lattice lattice = hexmesh::build_lattice(
        volume, {{volume.segments[0], hexmesh::material_from_units(100, 0.3, 1000), 0, ""}}, {5, {0, 0, 0}});
    const auto sinks = [&, strain = strain, gravity = gravity, volumetric = volumetric](const char* stiffness,
                                                                                        int level) {
      SolveReport report;
      const hexmesh::Result result = solve_equilibrium(
          lattice,
          parse_scene(std::string("[solve]\ntolerance = 1e-12\nvolumetric = \"") + volumetric + "\"\nstrain = \"" +
                          strain + "\"\nstiffness = \"" + stiffness +
                          "\"\n[[fix]]\nbox_mm = [-1, -0.4, -1, 16, -1, 16]\n[gravity]\nm_s2 = [0, 0, -" + gravity +
                          "]\n",
                      "test", ""),
          level, report);
      return -displacement_inside(result, {Vec3(63, 8, 8)})[0][2];
    };
    const double exact = sinks("exact", 0);
    EXPECT_NEAR(sinks("incompatible", 0), exact, 1e-9 * exact) << "voxels are as they were";
    EXPECT_NEAR(sinks("condensed", 0), exact, 1e-9 * exact) << "voxels are as they were";
    EXPECT_NEAR(sinks("incompatible", 3), exact, 0.025 * exact) << strain;
    EXPECT_NEAR(sinks("incompatible", 4), exact, 0.04 * exact) << strain;
    if (volumetric == std::string("mean")) {
      EXPECT_GT(sinks("exact", 4), 1.15 * exact) << "changes of volume of mean zero are free";
      continue;
    }
    EXPECT_LT(sinks("exact", 3), 0.9 * exact) << strain;
    EXPECT_LT(sinks("exact", 4), 0.7 * exact) << strain;
  }
}

}  // namespace test_elastic
