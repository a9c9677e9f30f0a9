// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "hexmesh/lattice/condensed_cells.h"
#include "hexmesh/lattice/element_tree.h"
#include "support/bodies.h"

namespace test_condensed_cells {

using namespace hexmesh;
using namespace testing_support;

constexpr double rounding = 1e-11;

/// A block with an oblique fissure that ends within it, and a few voxels that are missing.
Lattice fissured() {
  const auto volume = make_volume({20, 12, 10}, {1, 1.25, 1.5}, [](const Index3& v) {
    return (v[0] + v[2] == 14 && v[1] > 4) || (v[0] + 3 * v[1] + 5 * v[2]) % 17 == 0 ? 0 : 1;
  });
  return build_lattice(volume, {{volume.segments[0], material_from_units(100, 0.45, 1000), 0, ""}},
                       {4, {1, 3, 2}, {true, {}}});
}

std::vector<Lattice> lattices() { return {bitten_ball({1, 1, 1}), bitten_ball({1, 1.2, 3}, {1, 2, 3}), fissured()}; }

std::vector<int> levels_above_voxels(const Lattice& lattice) {
  std::vector<int> out;
  for (int level = 1; level < lattice.num_levels(); ++level) out.push_back(level);
  return out;
}

CellMatrix stiffness(const CondensedElement& c) {
  return mean_dilatation_stiffness(c.stiffness, c.divergence, c.excess, c.volume);
}

/// Of each level, in order.
std::vector<CondensedLevel> condense(const Lattice& lattice, const std::vector<int>& levels,
                                     const std::vector<ActingPoint>& acting, CondensedDilatation dilatation) {
  Condensation condensation(lattice, acting, dilatation);
  std::vector<CondensedLevel> out;
  for (const int level : levels) out.push_back(condensation.level(level));
  return out;
}

/// In the middle of each, or of each n-th, voxel.
std::vector<ActingPoint> in_voxels(const Lattice& lattice, std::size_t each = 1) {
  std::vector<ActingPoint> out;
  const std::vector<Index3>& voxels = lattice.level(0).cells;
  for (std::size_t v = 0; v < voxels.size(); v += each)
    out.push_back({static_cast<std::int32_t>(v), Vec3(voxels[v][0], voxels[v][1], voxels[v][2])});
  return out;
}

double least_eigenvalue(const CellMatrix& k) { return Eigen::SelfAdjointEigenSolver<CellMatrix>(k).eigenvalues()[0]; }

TEST(CondensedCells, WithoutInnerNodesAreThePapersCells) {
  for (const Lattice& lattice : lattices()) {
    const std::vector<int> levels = levels_above_voxels(lattice);
    const auto condensed = condense(lattice, levels, in_voxels(lattice), CondensedDilatation::full);
    ASSERT_EQ(condensed.size(), levels.size());
    for (std::size_t n = 0; n < levels.size(); ++n) {
      const Level& level = lattice.level(levels[n]);
      const ElementMatrices matrices(lattice.cell_edges(levels[n]));
      const std::vector<Element> elements = form_elements(lattice, levels[n]);
      ASSERT_EQ(condensed[n].kind.size(), level.cells.size());
      for (std::size_t c = 0; c < level.cells.size(); ++c) {
        const std::int32_t kind = condensed[n].kind[c];
        EXPECT_EQ(condensed[n].element[as_size(kind)], level.element[c]);
        const CondensedElement& cell = condensed[n].condensed[as_size(kind)];
        const Element& element = elements[as_size(level.element[c])];
        const CellMatrix k = matrices.stiffness(element);
        EXPECT_LT((stiffness(cell) - k).norm(), rounding * k.norm());
        const CellVector b = matrices.divergence(element);
        EXPECT_LT((cell.divergence - b).norm(), rounding * b.norm());
        EXPECT_NEAR(cell.volume, element.volume(), rounding * element.volume());
      }
    }
  }
}

TEST(CondensedCells, AreSofterThanThePapersAndStoreNothingInRigidMotionsAlone) {
  for (const Lattice& lattice : lattices())
    for (const CondensedDilatation dilatation : {CondensedDilatation::full, CondensedDilatation::mean}) {
      const std::vector<int> levels = levels_above_voxels(lattice);
      const auto none = condense(lattice, levels, {}, dilatation),
                 some = condense(lattice, levels, in_voxels(lattice, 7), dilatation),
                 all = condense(lattice, levels, in_voxels(lattice), dilatation);
      bool is_any_softer = false;
      for (std::size_t n = 0; n < levels.size(); ++n) {
        const Mat3 edges = lattice.cell_edges(levels[n]);
        for (std::size_t c = 0; c < lattice.level(levels[n]).cells.size(); ++c) {
          const auto of = [&](const std::vector<CondensedLevel>& from) {
            return stiffness(from[n].condensed[as_size(from[n].kind[c])]);
          };
          const CellMatrix k = of(none), k_some = of(some), k_all = of(all);
          EXPECT_LT((k - k.transpose()).norm(), rounding * k.norm());
          is_any_softer |= (k_all - k).norm() > 0.1 * k_all.norm();
          for (int motion = 0; motion < 6; ++motion) {
            CellVector rigid;
            for (int a = 0; a < 8; ++a) {
              const Vec3 x = edges * Vec3(corner_bit(a, 0), corner_bit(a, 1), corner_bit(a, 2));
              rigid.segment<3>(3 * a) = motion < 3 ? Vec3(Vec3::Unit(motion)) : Vec3(Vec3::Unit(motion - 3).cross(x));
            }
            EXPECT_LT((k * rigid).norm(), rounding * k_all.norm() * rigid.norm());
          }
          // The mean dilatation is that of other cells on each level: an order of energies on one level alone.
          if (dilatation == CondensedDilatation::mean && levels[n] > 1) continue;
          EXPECT_GT(least_eigenvalue(k_all - k_some), -rounding * k_all.norm());
          EXPECT_GT(least_eigenvalue(k_some - k), -rounding * k_all.norm());
          // What a corner that little material reaches keeps of its stiffness: (1 - 2/3)^2 a level.
          const double kept = std::pow((1 - relaxing) * (1 - relaxing), levels[n]);
          EXPECT_GT(least_eigenvalue(k - kept * k_all), -rounding * k_all.norm());
        }
      }
      EXPECT_TRUE(is_any_softer);
    }
}

TEST(CondensedCells, OfALevelAreTheSameInWhateverOrderTheyAreTaken) {
  for (const Lattice& lattice : lattices()) {
    const std::vector<ActingPoint> acting = in_voxels(lattice, 7);
    const int coarsest = lattice.num_levels() - 1;
    ASSERT_GE(coarsest, 2);
    Condensation kept(lattice, acting, CondensedDilatation::mean), taken(lattice, acting, CondensedDilatation::mean);
    for (const int level : {coarsest, 1, coarsest, 2}) {
      const CondensedLevel& expected = kept.level(level);
      const CondensedLevel found = taken.take(level);
      EXPECT_EQ(found.kind, expected.kind);
      EXPECT_EQ(found.element, expected.element);
      ASSERT_EQ(found.condensed.size(), expected.condensed.size());
      for (std::size_t k = 0; k < found.condensed.size(); ++k) {
        EXPECT_EQ(found.condensed[k].stiffness, expected.condensed[k].stiffness);
        EXPECT_EQ(found.condensed[k].divergence, expected.condensed[k].divergence);
        EXPECT_EQ(found.condensed[k].weight, expected.condensed[k].weight);
      }
    }
    EXPECT_TRUE(kept.is_of(lattice, acting, CondensedDilatation::mean));
    EXPECT_FALSE(kept.is_of(lattice, in_voxels(lattice), CondensedDilatation::mean));
    EXPECT_FALSE(kept.is_of(lattice, acting, CondensedDilatation::full));
  }
}

TEST(CondensedCells, InnerNodesGoTwoThirdsOfTheWayToWhereEnergyIsLeast) {
  // Five voxels in one cell: of the nodes but its corners none has another cell.
  const std::vector<Index3> filled = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 1}, {1, 1, 1}};
  const Vec3 spacing(1, 1.2, 0.9);
  const auto volume = make_volume({2, 2, 2}, spacing, [&](const Index3& v) {
    return static_cast<int>(std::count(filled.begin(), filled.end(), v));
  });
  const Material material = material_from_units(100, 0.45, 1000);
  const Lattice lattice = build_lattice(volume, {{volume.segments[0], material, 0, ""}}, {2, {0, 0, 0}, {false, {}}});
  ASSERT_EQ(lattice.level(1).cells.size(), 1U);
  const ElementMatrices matrices(lattice.cell_edges(0));
  const double voxel = lattice.voxels.voxel_volume();
  const Element element = full_voxel(material, voxel);
  const CellVector b = matrices.divergence(element);
  const NodeNumbering numbering = nodes_of(lattice.level(0));
  const Eigen::Index dofs = 3 * static_cast<Eigen::Index>(numbering.nodes.size());

  for (const CondensedDilatation dilatation : {CondensedDilatation::full, CondensedDilatation::mean}) {
    // The energy of the voxels, half of u^T k u, with the cell's mean dilatation.
    const double bulk = material.bulk_modulus(), first = 2.0 / 3 * material.shear_modulus();
    const CellMatrix of_voxel = dilatation == CondensedDilatation::full
                                    ? matrices.stiffness(element)
                                    : CellMatrix(matrices.deviatoric(element) + first / voxel * b * b.transpose());
    Eigen::MatrixXd k = Eigen::MatrixXd::Zero(dofs, dofs);
    Eigen::VectorXd of_cell = Eigen::VectorXd::Zero(dofs);
    for (const CellNodes& nodes : numbering.cell_nodes)
      for (int m = 0; m < 8; ++m) {
        of_cell.segment<3>(3 * nodes[as_size(m)]) += b.segment<3>(3 * m);
        for (int n = 0; n < 8; ++n)
          k.block<3, 3>(3 * nodes[as_size(m)], 3 * nodes[as_size(n)]) += of_voxel.block<3, 3>(3 * m, 3 * n);
      }
    if (dilatation == CondensedDilatation::mean)
      k += (bulk - first) / (static_cast<double>(filled.size()) * voxel) * of_cell * of_cell.transpose();

    const CellVector corners = noise(24, 1, 3);
    Eigen::VectorXd u(dofs);
    std::vector<Eigen::Index> inner;
    for (std::size_t n = 0; n < numbering.nodes.size(); ++n) {
      const Index3& node = numbering.nodes[n];
      const NodeWeights weights = shape_functions(Vec3(node[0], node[1], node[2]) / 2);
      Vec3 moved = Vec3::Zero();
      for (int a = 0; a < 8; ++a) moved += weights[a] * corners.segment<3>(3 * a);
      const auto row = 3 * static_cast<Eigen::Index>(n);
      u.segment<3>(row) = moved;
      if (weights.maxCoeff() < 1) inner.insert(inner.end(), {row, row + 1, row + 2});
    }
    ASSERT_GT(inner.size(), 30U);
    Eigen::VectorXd rests = u;
    rests(inner) -= k(inner, inner).llt().solve((k * u)(inner));
    const Eigen::VectorXd between = u + relaxing * (rests - u);
    const auto condensed = condense(lattice, {1}, {}, dilatation);
    const double energy = corners.dot(stiffness(condensed[0].condensed[0]) * corners);
    EXPECT_NEAR(energy, between.dot(k * between), rounding * u.dot(k * u));
    EXPECT_LT(energy, 0.5 * u.dot(k * u));
  }
}

}  // namespace test_condensed_cells
