// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "hexmesh/lattice/element.h"
#include "support/bodies.h"

namespace test_element {

using namespace hexmesh;
using testing_support::random_rotation;

const Material soft = material_from_units(100, 0.3, 1000);
const Material stiff = material_from_units(2500, 0.45, 1900);
constexpr double single_cell = 1e-12;  // relative, DESIGN: invariants of a single cell

/// The textbook stiffness int B^T D B dV of a full brick by 2 x 2 x 2 Gauss points, independent of the 27 integrals.
CellMatrix textbook_stiffness(const Material& m, const Mat3& edges) {
  const double lambda = m.bulk_modulus() - 2 * m.shear_modulus() / 3, mu = m.shear_modulus();
  Eigen::Matrix<double, 6, 6> d = Eigen::Matrix<double, 6, 6>::Zero();
  d.topLeftCorner<3, 3>().setConstant(lambda);
  d.diagonal().array() += Eigen::Array<double, 6, 1>(2 * mu, 2 * mu, 2 * mu, mu, mu, mu);
  CellMatrix k = CellMatrix::Zero();
  for (int q = 0; q < 8; ++q) {
    const double gauss = 0.5 / std::sqrt(3.0);
    Vec3 s;
    for (int a = 0; a < 3; ++a) s[a] = 0.5 + (corner_bit(q, a) ? gauss : -gauss);
    const NodeGradients g = shape_gradients(s) * edges.inverse();
    Eigen::Matrix<double, 6, 24> b = Eigen::Matrix<double, 6, 24>::Zero();
    for (int a = 0; a < 8; ++a) {
      for (int i = 0; i < 3; ++i) b(i, 3 * a + i) = g(a, i);
      b(3, 3 * a + 1) = b(4, 3 * a + 0) = g(a, 2);
      b(3, 3 * a + 2) = b(5, 3 * a + 0) = g(a, 1);
      b(4, 3 * a + 2) = b(5, 3 * a + 1) = g(a, 0);
    }
    k += b.transpose() * d * b * std::abs(edges.determinant()) / 8;
  }
  return k;
}

/// L of the paper for one child, from the shape functions: u_child = L u_parent.
Eigen::MatrixXd interpolation(int slot, const Index3& factor) {
  Eigen::MatrixXd l = Eigen::MatrixXd::Zero(24, 24);
  for (int a = 0; a < 8; ++a) {
    Vec3 s;
    for (int d = 0; d < 3; ++d) s[d] = double(corner_bit(slot, d) + corner_bit(a, d)) / factor[d];
    const NodeWeights n = shape_functions(s);
    for (int b = 0; b < 8; ++b) l.block<3, 3>(3 * a, 3 * b) = n[b] * Mat3::Identity();
  }
  return l;
}

Vec3 as_vec(const Index3& i) { return {double(i[0]), double(i[1]), double(i[2])}; }

/// Cells of every kind: how children are merged, which are there, and of what.
struct Case {
  Index3 factor;
  int filled;  ///< bit mask of slots
  int stiff;   ///< bit mask of slots
};

void PrintTo(const Case& c, std::ostream* out) {
  *out << "children " << c.factor[0] << c.factor[1] << c.factor[2] << " filled " << c.filled << " stiff " << c.stiff;
}

class ElementRecursion : public testing::TestWithParam<Case> {
protected:
  const Mat3 child_edges = random_rotation(7) * Vec3(0.8, 1.1, 2.5).asDiagonal();
  const Mat3 parent_edges = child_edges * as_vec(GetParam().factor).asDiagonal();

  bool has(int slot) const {
    for (int d = 0; d < 3; ++d)
      if (corner_bit(slot, d) && GetParam().factor[d] == 1) return false;
    return (GetParam().filled >> slot & 1) != 0;
  }
  const Material& material(int slot) const { return GetParam().stiff >> slot & 1 ? stiff : soft; }

  Element parent() const {
    Element e;
    for (int slot = 0; slot < 8; ++slot)
      if (has(slot))
        add_child(e, full_voxel(material(slot), std::abs(child_edges.determinant())), slot, GetParam().factor);
    return e;
  }
};

TEST_P(ElementRecursion, EqualsTheSumOfLtKL) {
  CellMatrix expected = CellMatrix::Zero();
  for (int slot = 0; slot < 8; ++slot) {
    if (!has(slot)) continue;
    const Eigen::MatrixXd l = interpolation(slot, GetParam().factor);
    expected += l.transpose() * textbook_stiffness(material(slot), child_edges) * l;
  }
  const CellMatrix k = ElementMatrices(parent_edges).stiffness(parent());
  EXPECT_LT((k - expected).norm(), single_cell * expected.norm());
}

TEST_P(ElementRecursion, MassAndDivergenceFollowTheSameRule) {
  const ElementMatrices child(child_edges), whole(parent_edges);
  Eigen::MatrixXd mass = Eigen::MatrixXd::Zero(8, 8);
  CellVector divergence = CellVector::Zero();
  for (int slot = 0; slot < 8; ++slot) {
    if (!has(slot)) continue;
    const Element e = full_voxel(material(slot), std::abs(child_edges.determinant()));
    const Eigen::MatrixXd l = interpolation(slot, GetParam().factor);
    Eigen::MatrixXd scalar(8, 8);
    for (int a = 0; a < 8; ++a)
      for (int b = 0; b < 8; ++b) scalar(a, b) = l(3 * a, 3 * b);
    mass += scalar.transpose() * child.mass(e) * scalar;
    divergence += l.transpose() * child.divergence(e);
  }
  EXPECT_LT((whole.mass(parent()) - mass).norm(), single_cell * mass.norm());
  EXPECT_LT((whole.divergence(parent()) - divergence).norm(), single_cell * divergence.norm());
}

TEST_P(ElementRecursion, SixRigidMotionsStoreNoEnergy) {
  const Element e = parent();
  const ElementMatrices matrices(parent_edges);
  for (const CellMatrix& k : {matrices.stiffness(e), matrices.mean_dilatation_stiffness(e)}) {
    for (int mode = 0; mode < 6; ++mode) {
      CellVector v;
      for (int a = 0; a < 8; ++a) {
        const Vec3 x = parent_edges * Vec3(corner_bit(a, 0), corner_bit(a, 1), corner_bit(a, 2));
        v.segment<3>(3 * a) = mode < 3 ? Vec3(Vec3::Unit(mode)) : Vec3(Vec3::Unit(mode - 3).cross(x));
      }
      EXPECT_LT((k * v).norm(), single_cell * k.norm() * v.norm());
    }
    EXPECT_LT((k - k.transpose()).norm(), single_cell * k.norm());
    const Eigen::SelfAdjointEigenSolver<CellMatrix> eigen(k);
    EXPECT_GT(eigen.eigenvalues()[0], -single_cell * k.norm());
  }
}

TEST_P(ElementRecursion, ALinearFieldStoresTheEnergyOfTheFilledVolume) {
  Mat3 gradient;
  gradient << 0.1, -0.05, 0.02, 0.3, 0.2, -0.1, 0.07, 0.04, -0.15;
  const Mat3 strain = 0.5 * (gradient + gradient.transpose());
  CellVector u;
  for (int a = 0; a < 8; ++a)
    u.segment<3>(3 * a) = gradient * parent_edges * Vec3(corner_bit(a, 0), corner_bit(a, 1), corner_bit(a, 2));
  double expected = 0;
  for (int slot = 0; slot < 8; ++slot)
    if (has(slot)) {
      const Material& m = material(slot);
      const double lambda = m.bulk_modulus() - 2 * m.shear_modulus() / 3;
      expected += std::abs(child_edges.determinant()) *
                  (m.shear_modulus() * strain.squaredNorm() + lambda / 2 * strain.trace() * strain.trace());
    }
  const ElementMatrices matrices(parent_edges);
  EXPECT_NEAR(0.5 * u.dot(matrices.stiffness(parent()) * u), expected, single_cell * expected);
  EXPECT_NEAR(0.5 * u.dot(matrices.mean_dilatation_stiffness(parent()) * u), expected, single_cell * expected);
}

/// Strains (3 x 3, one above the other) of the cell's 24 displacements and of (xi_j - c_j)^2 of each axis j.
Eigen::Matrix<double, 9, 33> strains_at(const Vec3& xi, const Vec3& centroid, const Mat3& edges) {
  const Mat3 inverse = edges.inverse();
  const NodeGradients g = shape_gradients(xi) * inverse;
  Eigen::Matrix<double, 9, 33> out;
  for (int n = 0; n < 33; ++n) {
    const int shape = n / 3;
    const Vec3 along =
        shape < 8 ? Vec3(g.row(shape)) : Vec3(2 * (xi - centroid)[shape - 8] * inverse.row(shape - 8).transpose());
    Mat3 gradient = Mat3::Zero();
    gradient.row(n % 3) = along;
    const Mat3 strain = 0.5 * (gradient + gradient.transpose());
    out.col(n) = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(strain.data());
  }
  return out;
}

TEST_P(ElementRecursion, IncompatibleModesAreCondensed) {
  // Gauss's three points along each axis of each child are exact, and know nothing of the 27 integrals.
  Vec3 centroid = Vec3::Zero();
  int count = 0;
  const auto for_each_point = [&](auto&& f) {
    for (int slot = 0; slot < 8; ++slot) {
      if (!has(slot)) continue;
      for (int q = 0; q < 27; ++q) {
        Vec3 xi;
        double weight = std::abs(child_edges.determinant());
        for (int d = 0; d < 3; ++d) {
          const int point = q / (d == 0 ? 1 : d == 1 ? 3 : 9) % 3;
          xi[d] = (corner_bit(slot, d) + 0.5 + (point - 1) * std::sqrt(0.15)) / GetParam().factor[d];
          weight *= point == 1 ? 4.0 / 9 : 5.0 / 18;
        }
        f(xi, weight, material(slot));
      }
    }
  };
  for_each_point([&](const Vec3& xi, double, const Material&) { centroid += xi, ++count; });
  centroid /= count;
  for (const bool counts_dilatation : {false, true}) {
    Eigen::Matrix<double, 33, 33> k = Eigen::Matrix<double, 33, 33>::Zero();
    for_each_point([&](const Vec3& xi, double weight, const Material& m) {
      const auto b = strains_at(xi, centroid, parent_edges);
      const Eigen::Matrix<double, 1, 33> dilatation = b.row(0) + b.row(4) + b.row(8);
      const double lambda = (counts_dilatation ? m.bulk_modulus() : 0) - 2 * m.shear_modulus() / 3;
      k += weight * (2 * m.shear_modulus() * b.transpose() * b + lambda * dilatation.transpose() * dilatation);
    });
    Eigen::Matrix<double, 33, 33> linear_part = Eigen::Matrix<double, 33, 33>::Zero();
    if (!counts_dilatation)
      for_each_point([&](const Vec3& xi, double weight, const Material& m) {
        Eigen::Matrix<double, 1, 33> dilatation = Eigen::Matrix<double, 1, 33>::Zero();
        for (int d = 0; d < 3; ++d) {
          constexpr double h = 0.25;  // div u is linear along each axis
          const auto up = strains_at(centroid + h * Vec3::Unit(d), centroid, parent_edges),
                     down = strains_at(centroid - h * Vec3::Unit(d), centroid, parent_edges);
          for (const int row : {0, 4, 8}) dilatation += (up.row(row) - down.row(row)) / (2 * h) * (xi[d] - centroid[d]);
        }
        linear_part += weight * m.bulk_modulus() * dilatation.transpose() * dilatation;
      });
    const Eigen::Matrix<double, 33, 33> counted = k + linear_part;
    const Eigen::MatrixXd expected = counted.topRightCorner<24, 9>() * counted.bottomRightCorner<9, 9>().inverse() *
                                         counted.bottomLeftCorner<9, 24>() -
                                     linear_part.topLeftCorner<24, 24>();
    const CellMatrix relaxed = ElementMatrices(parent_edges).relaxation(parent(), counts_dilatation);
    EXPECT_LT((relaxed - expected).norm(), single_cell * k.norm());
    EXPECT_EQ(relaxed, CellMatrix(relaxed.transpose()));
    const Eigen::SelfAdjointEigenSolver<CellMatrix> left(k.topLeftCorner<24, 24>() - relaxed);
    EXPECT_GT(left.eigenvalues()[0], -single_cell * k.norm());
    const CellMatrix cell = counts_dilatation ? ElementMatrices(parent_edges).stiffness(parent())
                                              : ElementMatrices(parent_edges).mean_dilatation_stiffness(parent());
    const Eigen::SelfAdjointEigenSolver<CellMatrix> whole(cell - relaxed);
    EXPECT_LT(whole.eigenvalues()[5], 1e-12 * k.norm()) << "rigid motions";
    EXPECT_GT(whole.eigenvalues()[6], 1e-6 * k.norm()) << "nothing else goes for nothing";

    if ((GetParam().stiff & GetParam().filled) != 0) continue;  // one material: constant stresses do no work in them
    CellVector linear;
    for (int a = 0; a < 8; ++a)
      linear.segment<3>(3 * a) = random_rotation(5) * Vec3(1, -2, 3).asDiagonal() * parent_edges *
                                 Vec3(corner_bit(a, 0), corner_bit(a, 1), corner_bit(a, 2));
    EXPECT_LT((relaxed * linear).norm(), single_cell * k.norm() * linear.norm());
  }
}

TEST(Element, IncompatibleModesBendAsABeamDoes) {
  // sigma_x = E y alone: what a beam between two couples is under, whichever part of the cell it fills.
  const Material m = material_from_units(100, 0.3, 1000);
  const double young = 0.1, nu = 0.3;
  const Mat3 edges = Vec3(2, 3, 4).asDiagonal();
  for (const std::vector<int>& filled : {std::vector<int>{0, 1, 2, 3, 4, 5, 6, 7}, {0, 1, 4, 5}, {2, 3}, {6}}) {
    Element e;
    Vec3 low = Vec3::Ones(), high = Vec3::Zero();
    for (const int slot : filled) {
      add_child(e, full_voxel(m, 3), slot, {2, 2, 2});
      for (int d = 0; d < 3; ++d) {
        low[d] = std::min(low[d], corner_bit(slot, d) / 2.0);
        high[d] = std::max(high[d], corner_bit(slot, d) / 2.0 + 0.5);
      }
    }
    const Vec3 middle = edges * (low + high) / 2, size = edges * (high - low);
    CellVector u;
    for (int a = 0; a < 8; ++a) {
      const Vec3 x = edges * Vec3(corner_bit(a, 0), corner_bit(a, 1), corner_bit(a, 2)) - middle;
      u.segment<3>(3 * a) << x[0] * x[1], 0, -nu * x[1] * x[2];  // and modes, -(x^2 + nu (y^2 - z^2)) / 2 along y
    }
    const double expected = young / 2 * size.prod() * size[1] * size[1] / 12;
    const ElementMatrices matrices(edges);
    for (const bool is_mean : {false, true}) {
      const CellMatrix k = is_mean ? matrices.mean_dilatation_stiffness(e) : matrices.stiffness(e);
      EXPECT_NEAR(0.5 * u.dot((k - matrices.relaxation(e, !is_mean)) * u), expected,
                  1e-12 * k.norm() * u.squaredNorm());
      if (!is_mean) {
        EXPECT_GT(0.5 * u.dot(k * u), 1.2 * expected) << "trilinear cells shear";
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Cells, ElementRecursion,
                         testing::Values(Case{{2, 2, 2}, 0xff, 0x00}, Case{{2, 2, 2}, 0xff, 0x35},
                                         Case{{2, 2, 2}, 0x01, 0x00}, Case{{2, 2, 2}, 0x6b, 0x09},
                                         Case{{2, 2, 1}, 0x0f, 0x02}, Case{{2, 1, 1}, 0x02, 0x00},
                                         Case{{1, 1, 2}, 0x11, 0x10}));

TEST(Element, AFullParentIsTheBigCell) {
  const Mat3 edges = Vec3(2, 3, 4).asDiagonal();
  Element e;
  for (int slot = 0; slot < 8; ++slot) add_child(e, full_voxel(soft, 3), slot, {2, 2, 2});
  const CellMatrix expected = textbook_stiffness(soft, edges);
  EXPECT_LT((ElementMatrices(edges).stiffness(e) - expected).norm(), single_cell * expected.norm());
}

TEST(Element, SpreadEvenlyIsTheFillWeightedFullCell) {
  Element half;
  for (const int slot : {0, 1, 2, 3}) add_child(half, full_voxel(soft, 3), slot, {2, 2, 2});
  const Mat3 edges = Vec3(2, 3, 4).asDiagonal();
  const CellMatrix expected = textbook_stiffness(soft, edges) / 2;
  const Element even = spread_evenly(half);
  EXPECT_LT((ElementMatrices(edges).stiffness(even) - expected).norm(), single_cell * expected.norm());
  EXPECT_NEAR(even.volume(), half.volume(), single_cell * half.volume());
  EXPECT_EQ(even.density, half.density);
}

TEST(Element, MassIsSplitOverTheNodesByDensityNotByStiffness) {
  Element e;
  add_child(e, full_voxel(material_from_units(1e6, 0.3, 1000), 1), 0, {2, 1, 1});
  add_child(e, full_voxel(material_from_units(1, 0.3, 1000), 1), 1, {2, 1, 1});
  const NodeWeights m = ElementMatrices(Vec3(2, 1, 1).asDiagonal()).lumped_mass(e);
  EXPECT_NEAR(m.sum(), 2e-9, 1e-21);
  EXPECT_NEAR(m[0], m[1], 1e-21);
}

TEST(Element, MeanShapeAveragesAFieldOverTheFilledPart) {
  // Three of eight children filled: a linear field's mean is its value at their centre of volume.
  Element e;
  Vec3 center = Vec3::Zero();
  for (const int slot : {0, 1, 6}) {
    add_child(e, full_voxel(material_from_units(100, 0.3, 1000), 6), slot, {2, 2, 2});
    for (int d = 0; d < 3; ++d) center[d] += (corner_bit(slot, d) ? 0.75 : 0.25) / 3;
  }
  const NodeWeights mean = ElementMatrices(Vec3(2, 4, 6).asDiagonal()).mean_shape(e);
  EXPECT_NEAR(mean.sum(), 1, 1e-14);
  for (int d = 0; d < 3; ++d) {
    double average = 0;
    for (int a = 0; a < num_cell_nodes; ++a) average += mean[a] * corner_bit(a, d);
    EXPECT_NEAR(average, center[d], 1e-14);
  }
}

}  // namespace test_element
