// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "hexmesh/lattice/segment_shares.h"
#include "support/bodies.h"
#include "terms/make_elastic_cells.h"
#include "terms/prestress.h"

namespace test_prestretch {

using namespace hexsolver;
using namespace testing_support;

Mat3 symmetric(unsigned seed, double size) {
  const NodeVector values = noise(9, size, seed);
  const Mat3 m = Eigen::Map<const Mat3>(values.data());
  return (m + m.transpose()) / 2;
}

struct Case {
  Elasticity law;
  Volumetric volumetric;
  int level;
};

/// Two materials, cells partly filled, stretched on the lattice.
class Prestretched : public testing::TestWithParam<Case> {
protected:
  std::unique_ptr<ElasticCells> make(const std::vector<Mat3>& stretches, const NodeVector& to_rest) const {
    ElasticSettings settings;
    settings.elasticity = GetParam().law;
    settings.volumetric = GetParam().volumetric;
    settings.is_reshaped = true;
    auto elastic = make_elastic_cells(mesh, cells, settings);
    elastic->set_prestretch(stretches);
    EXPECT_TRUE(elastic->set_rest(to_rest));
    return elastic;
  }
  std::vector<Mat3> different_ones() const {
    std::vector<Mat3> out;
    for (unsigned c = 0; c < mesh.num_cells(); ++c) out.emplace_back(Mat3::Identity() + symmetric(c, 0.03));
    return out;
  }
  NodeVector gradient(const Term& term, const NodeVector& u) const {
    NodeVector g = NodeVector::Zero(u.size()), magnitude = g;
    term.add_gradient(u, g, magnitude);
    return g;
  }

  const Lattice lattice = bitten_ball({1, 1.2, 2}, {0, 1, 0});
  const MeshCells cells{lattice, GetParam().level};
  Mesh mesh = cells.make_mesh();
  const NodeVector zero = NodeVector::Zero(static_cast<Eigen::Index>(mesh.num_dofs()));
};

/// Alike everywhere, the stretch goes where the body shrinks by it, turned or not.
TEST_P(Prestretched, NothingIsStoredWhereItIsTakenBack) {
  if (GetParam().law == Elasticity::cauchy) return;  // only to first order
  const Mat3 stretch = Mat3::Identity() + symmetric(3, 0.2);
  const auto elastic = make(std::vector<Mat3>(mesh.num_cells(), stretch), zero);
  const Mat3 turn = random_rotation(5);
  const NodeVector back = sample(mesh, [&](const Vec3& x) -> Vec3 { return turn * stretch.inverse() * x - x; });
  const double stored = elastic->energy(zero);
  EXPECT_GT(stored, 0);
  EXPECT_LT(elastic->energy(back), 1e-15 * stored);
  EXPECT_LT(gradient(*elastic, back).norm(), 1e-11 * gradient(*elastic, zero).norm());
  elastic->move_to(back);
  EXPECT_LT(elastic->energy(back), 1e-15 * stored);
  EXPECT_LT(gradient(*elastic, back).norm(), 1e-11 * gradient(*elastic, zero).norm());
}

/// What is told of the body's change of shape is without it; its stress is there.
TEST_P(Prestretched, StressIsThatOfTheStretch) {
  const std::vector<Mat3> stretches = different_ones();
  const auto elastic = make(stretches, zero);
  const NodeVector at = zero;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    EXPECT_LT((elastic->mean_gradient(c, at) - Mat3::Identity()).norm(), 1e-12);
    EXPECT_NEAR(elastic->jacobians(c, at).least, 1, 1e-12);
    const auto under =
        stretch_under(GetParam().law, elastic->model(c).shear, elastic->model(c).bulk, elastic->stress(c, at));
    ASSERT_TRUE(under);
    EXPECT_LT((*under - stretches[c]).norm(), 1e-8);
  }
}

TEST_P(Prestretched, ForcesAndHessianAreDerivatives) {
  const NodeVector to_rest = noise(mesh.num_dofs(), 0.1, 9);
  const auto elastic = make(different_ones(), to_rest);
  constexpr double h = 1e-6;
  const NodeVector u = noise(mesh.num_dofs(), 0.1, 3), direction = noise(mesh.num_dofs(), 1, 5);
  const NodeVector g = gradient(*elastic, u);
  const double measured = (elastic->energy(u + h * direction) - elastic->energy(u - h * direction)) / (2 * h);
  EXPECT_NEAR(g.dot(direction), measured, 1e-6 * g.norm() * direction.norm());
  const double energy = elastic->energy(u);
  elastic->move_to(u);  // by the kernels of batches, where a law has them
  EXPECT_NEAR(elastic->energy(u), energy, 1e-12 * energy);
  EXPECT_LT((gradient(*elastic, u) - g).norm(), 1e-11 * g.norm());
  elastic->linearize(u, Hessian::exact);
  NodeVector claimed = zero;
  elastic->add_product(direction, claimed);
  const NodeVector change = (gradient(*elastic, u + h * direction) - gradient(*elastic, u - h * direction)) / (2 * h);
  EXPECT_LT((claimed - change).norm(), 1e-5 * change.norm());
}

TEST_P(Prestretched, ForcesOnTheLatticeAreThoseOfCellsAtRestElsewhere) {
  const NodeVector to_rest = noise(mesh.num_dofs(), 0.1, 9);
  const auto elsewhere = make(different_ones(), to_rest), on_lattice = make(different_ones(), zero);
  const NodeVector expected = gradient(*elsewhere, zero);
  NodeVector forces = zero, magnitude = zero;
  ASSERT_TRUE(on_lattice->add_gradient_on_lattice(to_rest, forces, magnitude));
  EXPECT_LT((forces - expected).norm(), 1e-12 * expected.norm());
}

INSTANTIATE_TEST_SUITE_P(Laws, Prestretched,
                         testing::Values(Case{Elasticity::cauchy, Volumetric::mean, 1},
                                         Case{Elasticity::corotational, Volumetric::mean, 0},
                                         Case{Elasticity::corotational, Volumetric::full, 2},
                                         Case{Elasticity::neo_hookean, Volumetric::mean, 1},
                                         Case{Elasticity::stable_neo_hookean, Volumetric::full, 0},
                                         Case{Elasticity::green_lagrange, Volumetric::full, 1}));

TEST(Prestress, StretchUnderAStressHasThatStress) {
  constexpr double shear = 0.7, bulk = 3;
  for (const Elasticity law : {Elasticity::cauchy, Elasticity::corotational, Elasticity::green_lagrange,
                               Elasticity::neo_hookean, Elasticity::stable_neo_hookean})
    for (unsigned seed = 1; seed <= 20; ++seed) {
      const Mat3 stress = symmetric(seed, 0.15);
      const auto stretch = stretch_under(law, shear, bulk, stress);
      ASSERT_TRUE(stretch) << int(law) << ' ' << seed;
      const Eigen::SelfAdjointEigenSolver<Mat3> axes(*stretch);
      const Vec3 principal = principal_stress(law, shear, bulk, axes.eigenvalues());
      const Mat3 there = axes.eigenvectors() * principal.asDiagonal() * axes.eigenvectors().transpose();
      EXPECT_LT((there - stress).norm(), 1e-8) << int(law) << ' ' << seed;
    }
}

/// At nu = 0 and E = 1 Hooke's co-rotational material has sigma = lambda - 1 along one axis, and no less than -1.
TEST(Prestress, StressThatALawDoesNotBearIsNotFound) {
  constexpr double shear = 0.5, bulk = 1.0 / 3;
  EXPECT_TRUE(stretch_under(Elasticity::corotational, shear, bulk, Vec3(0.9, 0, 0).asDiagonal()));
  EXPECT_FALSE(stretch_under(Elasticity::corotational, shear, bulk, Vec3(-1.1, 0, 0).asDiagonal()));
}

TEST(SegmentShares, OfAllSegmentsAddUpAndCountTheirVoxels) {
  const Lattice lattice = bitten_ball({1, 1.2, 2}, {0, 1, 0});
  for (int level = 0; level < lattice.num_levels(); ++level) {
    std::vector<double> volume(lattice.level(level).filled.size()), shear = volume;
    for (const hexmesh::LatticeSegment& s : lattice.segments) {
      if (!s.material) continue;
      const auto shares = hexmesh::shares_of_segment(lattice, level, s.segment.label);
      ASSERT_EQ(shares.size(), volume.size());
      double voxels = 0;
      for (const std::int32_t e : lattice.level(level).element) {
        const auto n = static_cast<std::size_t>(e);
        voxels += shares[n].volume * static_cast<double>(lattice.level(level).filled[n]);
      }
      EXPECT_NEAR(voxels, static_cast<double>(s.num_voxels), 1e-9 * voxels);
      for (std::size_t e = 0; e < shares.size(); ++e) {
        volume[e] += shares[e].volume;
        shear[e] += shares[e].shear;
      }
    }
    for (std::size_t e = 0; e < volume.size(); ++e) {
      EXPECT_NEAR(volume[e], 1, 1e-12);
      EXPECT_NEAR(shear[e], 1, 1e-12);
    }
  }
}

}  // namespace test_prestretch
