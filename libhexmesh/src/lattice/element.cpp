// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/element.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <numeric>

namespace hexmesh {
namespace {

/// Integral of l_q over a full cell of volume 1: the product of Simpson's weights.
double full_weight(int q) {
  constexpr std::array<double, 3> simpson = {1 / 6.0, 4 / 6.0, 1 / 6.0};
  return simpson[q % 3] * simpson[q / 3 % 3] * simpson[q / 9];
}

/// Parent weights along one axis from those of a child in its lower or upper half: w_i = sum_q l_i(x_q) w_q, where the
/// child's points -1, 0, 1 lie at -1, -1/2, 0 or at 0, 1/2, 1 of the parent.
/// @param stride  of the axis in a 3x3x3 array: 1, 3 or 9
void spread_along(int stride, bool upper, Element::Weights& w) {
  for (int line = 0; line < num_rule_points; ++line) {
    if (line / stride % 3 != 0) continue;
    double& near = w[line + (upper ? 2 * stride : 0)];  // the end that child and parent share
    double& far = w[line + (upper ? 0 : 2 * stride)];
    double& middle = w[line + stride];
    const double at_quarter = middle, at_center = far;
    near += 0.375 * at_quarter;
    middle = 0.75 * at_quarter + at_center;
    far = -0.125 * at_quarter;
  }
}

Vec3 rule_point(int q) { return {q % 3 / 2.0, q / 3 % 3 / 2.0, q / 9 / 2.0}; }

/// d with d . u = div u at a point.
CellVector divergence_at(const NodeGradients& g) {
  CellVector d;
  for (int a = 0; a < num_cell_nodes; ++a) d.segment<3>(3 * a) = g.row(a);
  return d;
}

/// The block of rows a and columns b of mu (grad u : grad u + grad u : grad u^T) + lambda (div u)^2 for shapes of
/// gradients a and b.
Mat3 strain_block(const Vec3& a, const Vec3& b, double mu, double lambda) {
  Mat3 block = mu * b * a.transpose() + lambda * a * b.transpose();
  block.diagonal().array() += mu * a.dot(b);
  return block;
}

double sum(const Element::Weights& w) { return std::accumulate(w.begin(), w.end(), 0.0); }

/// The lower triangle is the upper one to the last digit, as files hold matrices.
void make_symmetric(CellMatrix& k) {
  for (int column = 1; column < 24; ++column)
    for (int row = 0; row < column; ++row) k(column, row) = k(row, column);
}

}  // namespace

double Element::volume() const { return sum(fill); }
double Element::mass() const { return sum(density); }
double Element::total_shear() const { return sum(shear); }
double Element::total_bulk() const { return sum(bulk); }

Element full_voxel(const Material& material, double volume) {
  Element e;
  for (int q = 0; q < num_rule_points; ++q) {
    const double w = volume * full_weight(q);
    e.fill[q] = w;
    e.shear[q] = material.shear_modulus() * w;
    e.bulk[q] = material.bulk_modulus() * w;
    e.density[q] = material.density * w;
  }
  return e;
}

void add_child(Element& parent, const Element& child, int slot, const Index3& factor) {
  const auto add = [&](Element::Weights& to, Element::Weights from) {
    for (int d = 0, stride = 1; d < 3; ++d, stride *= 3)
      if (factor[d] == 2) spread_along(stride, corner_bit(slot, d), from);
    for (int q = 0; q < num_rule_points; ++q) to[q] += from[q];
  };
  add(parent.shear, child.shear);
  add(parent.bulk, child.bulk);
  add(parent.density, child.density);
  add(parent.fill, child.fill);
}

Element spread_evenly(const Element& element) {
  const double volume = element.volume(), shear = sum(element.shear), bulk = sum(element.bulk);
  Element even = element;
  for (int q = 0; q < num_rule_points; ++q) {
    const double w = full_weight(q);
    even.shear[q] = shear * w;
    even.bulk[q] = bulk * w;
    even.fill[q] = volume * w;
  }
  return even;
}

ElementMatrices::ElementMatrices(const Mat3& edges) : axis_gradients_(edges.inverse()) {
  for (int q = 0; q < num_rule_points; ++q) gradients_[q] = shape_gradients(rule_point(q)) * axis_gradients_;
}

CellMatrix ElementMatrices::deviatoric(const Element& element) const {
  // 2 mu dev(eps):dev(eps) = mu (grad u : grad u + grad u : grad u^T) - 2/3 mu (div u)^2
  CellMatrix k = CellMatrix::Zero();
  for (int q = 0; q < num_rule_points; ++q) {
    const double mu = element.shear[q];
    if (mu == 0) continue;
    const NodeGradients& g = gradients_[q];
    for (int b = 0; b < num_cell_nodes; ++b)
      for (int a = 0; a <= b; ++a) k.block<3, 3>(3 * a, 3 * b) += strain_block(g.row(a), g.row(b), mu, -2.0 / 3.0 * mu);
  }
  make_symmetric(k);
  return k;
}

CellMatrix ElementMatrices::volumetric(const Element& element) const {
  CellMatrix k = CellMatrix::Zero();
  for (int q = 0; q < num_rule_points; ++q) {
    if (element.bulk[q] == 0) continue;
    const CellVector div = divergence_at(gradients_[q]);
    k += element.bulk[q] * div * div.transpose();
  }
  make_symmetric(k);
  return k;
}

ElementMatrices::LinearDilatation ElementMatrices::linear_dilatation(const Element& element,
                                                                     const Vec3& centroid) const {
  LinearDilatation out;
  for (int q = 0; q < num_rule_points; ++q) {
    const Vec3 from_centroid = rule_point(q) - centroid;
    out.moments += element.bulk[q] * from_centroid * from_centroid.transpose();
  }
  for (int j = 0; j < 3; ++j) {
    Vec3 low = centroid, high = centroid;  // div u is linear along each axis
    low[j] = 0, high[j] = 1;
    out.of_nodes.col(j) = divergence_at((shape_gradients(high) - shape_gradients(low)) * axis_gradients_);
    out.of_modes.block<3, 1>(3 * j, j) = 2 * axis_gradients_.row(j);
  }
  return out;
}

CellMatrix ElementMatrices::relaxation(const Element& element, bool counts_dilatation) const {
  Vec3 centroid = Vec3::Zero();
  for (int q = 0; q < num_rule_points; ++q) centroid += element.fill[q] * rule_point(q);
  centroid /= element.volume();
  Eigen::Matrix<double, 24, 9> coupling = Eigen::Matrix<double, 24, 9>::Zero();
  Eigen::Matrix<double, 9, 9> modes = Eigen::Matrix<double, 9, 9>::Zero();
  for (int q = 0; q < num_rule_points; ++q) {
    const double mu = element.shear[q], lambda = (counts_dilatation ? element.bulk[q] : 0) - 2.0 / 3.0 * mu;
    const Mat3 of_modes = 2 * (rule_point(q) - centroid).asDiagonal() * axis_gradients_;
    for (int j = 0; j < 3; ++j) {
      const Vec3 along = of_modes.row(j);
      for (int a = 0; a < num_cell_nodes; ++a)
        coupling.block<3, 3>(3 * a, 3 * j) += strain_block(gradients_[q].row(a), along, mu, lambda);
      for (int i = j; i < 3; ++i) modes.block<3, 3>(3 * i, 3 * j) += strain_block(of_modes.row(i), along, mu, lambda);
    }
  }
  CellMatrix counted = CellMatrix::Zero();
  if (!counts_dilatation) {
    const auto [of_nodes, of_modes, moments] = linear_dilatation(element, centroid);
    coupling += of_nodes * moments * of_modes.transpose();
    modes += of_modes * moments * of_modes.transpose();
    counted = of_nodes * moments * of_nodes.transpose();
  }
  const Eigen::Matrix<double, 9, 24> relaxed = modes.ldlt().solve(coupling.transpose());
  CellMatrix k = coupling * relaxed - counted;
  make_symmetric(k);
  return k;
}

CellVector ElementMatrices::divergence(const Element& element) const {
  CellVector b = CellVector::Zero();
  for (int q = 0; q < num_rule_points; ++q) b += element.fill[q] * divergence_at(gradients_[q]);
  return b;
}

CellMatrix mean_dilatation_stiffness(const CellMatrix& deviatoric, const CellVector& divergence, double bulk,
                                     double volume) {
  return deviatoric + bulk / (volume * volume) * divergence * divergence.transpose();
}

CellMatrix ElementMatrices::mean_dilatation_stiffness(const Element& element) const {
  return hexmesh::mean_dilatation_stiffness(deviatoric(element), divergence(element), element.total_bulk(),
                                            element.volume());
}

Eigen::Matrix<double, 8, 8> ElementMatrices::mass(const Element& element) const {
  Eigen::Matrix<double, 8, 8> m = Eigen::Matrix<double, 8, 8>::Zero();
  for (int q = 0; q < num_rule_points; ++q) {
    const NodeWeights n = shape_functions(rule_point(q));
    m += element.density[q] * n * n.transpose();
  }
  return m;
}

NodeWeights ElementMatrices::shape(const Element& element) const {
  NodeWeights sum = NodeWeights::Zero();
  for (int q = 0; q < num_rule_points; ++q) sum += element.fill[q] * shape_functions(rule_point(q));
  return sum;
}

NodeWeights ElementMatrices::mean_shape(const Element& element) const { return shape(element) / element.volume(); }

NodeWeights ElementMatrices::lumped_mass(const Element& element) const { return mass(element).rowwise().sum(); }

}  // namespace hexmesh
