// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/element.h"

#include <Eigen/LU>
#include <numeric>

namespace hexmesh {
namespace {

using Matrix3x3 = std::array<std::array<double, 3>, 3>;

/// Quadratic Lagrange polynomials of the points -1, 0, 1.
std::array<double, 3> lagrange(double x) { return {x * (x - 1) / 2, 1 - x * x, x * (x + 1) / 2}; }

/// T[i][q] = l_i of the parent at point q of the child in the given half of it; identity where nothing is merged.
Matrix3x3 transfer(int factor, int half) {
  if (factor == 1) return {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  Matrix3x3 t{};
  for (int q = 0; q < 3; ++q) {
    const auto l = lagrange((q - 1) / 2.0 + (half ? 0.5 : -0.5));
    for (int i = 0; i < 3; ++i) t[i][q] = l[i];
  }
  return t;
}

/// out_i = sum_q t[i][q] in_q along one axis of a 3x3x3 array; stride = 1, 3 or 9.
Element::Weights apply_along(const Matrix3x3& t, int stride, const Element::Weights& in) {
  Element::Weights out{};
  for (int n = 0; n < num_rule_points; ++n) {
    const int position = n / stride % 3;
    const int line = n - position * stride;
    for (int q = 0; q < 3; ++q) out[n] += t[position][q] * in[line + q * stride];
  }
  return out;
}

Vec3 rule_point(int q) { return {q % 3 / 2.0, q / 3 % 3 / 2.0, q / 9 / 2.0}; }

/// d with d . u = div u at a point.
CellVector divergence_at(const NodeGradients& g) {
  CellVector d;
  for (int a = 0; a < num_cell_nodes; ++a) d.segment<3>(3 * a) = g.row(a);
  return d;
}

double sum(const Element::Weights& w) { return std::accumulate(w.begin(), w.end(), 0.0); }

}  // namespace

double Element::volume() const { return sum(fill); }
double Element::mass() const { return sum(density); }
double Element::total_bulk() const { return sum(bulk); }

Element full_voxel(const Material& material, double volume) {
  // The l_q integrate to Simpson's weights.
  constexpr std::array<double, 3> simpson = {1 / 6.0, 4 / 6.0, 1 / 6.0};
  Element e;
  for (int q = 0; q < num_rule_points; ++q) {
    const double w = volume * simpson[q % 3] * simpson[q / 3 % 3] * simpson[q / 9];
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
      from = apply_along(transfer(factor[d], corner_bit(slot, d)), stride, from);
    for (int q = 0; q < num_rule_points; ++q) to[q] += from[q];
  };
  add(parent.shear, child.shear);
  add(parent.bulk, child.bulk);
  add(parent.density, child.density);
  add(parent.fill, child.fill);
}

ElementMatrices::ElementMatrices(const Mat3& edges) {
  const Mat3 inverse = edges.inverse();
  for (int q = 0; q < num_rule_points; ++q) gradients_[q] = shape_gradients(rule_point(q)) * inverse;
}

CellMatrix ElementMatrices::deviatoric(const Element& element) const {
  // 2 mu dev(eps):dev(eps) = mu (grad u : grad u + grad u : grad u^T) - 2/3 mu (div u)^2
  CellMatrix k = CellMatrix::Zero();
  for (int q = 0; q < num_rule_points; ++q) {
    const double mu = element.shear[q];
    if (mu == 0) continue;
    const NodeGradients& g = gradients_[q];
    for (int b = 0; b < num_cell_nodes; ++b)
      for (int a = 0; a <= b; ++a) {
        const Vec3 ga = g.row(a), gb = g.row(b);
        Mat3 block = gb * ga.transpose() - 2.0 / 3.0 * ga * gb.transpose();
        block.diagonal().array() += ga.dot(gb);
        k.block<3, 3>(3 * a, 3 * b) += mu * block;
      }
  }
  for (int b = 0; b < num_cell_nodes; ++b)
    for (int a = 0; a < b; ++a) k.block<3, 3>(3 * b, 3 * a) = k.block<3, 3>(3 * a, 3 * b).transpose();
  return k;
}

CellMatrix ElementMatrices::volumetric(const Element& element) const {
  CellMatrix k = CellMatrix::Zero();
  for (int q = 0; q < num_rule_points; ++q) {
    if (element.bulk[q] == 0) continue;
    const CellVector div = divergence_at(gradients_[q]);
    k += element.bulk[q] * div * div.transpose();
  }
  return k;
}

CellVector ElementMatrices::divergence(const Element& element) const {
  CellVector b = CellVector::Zero();
  for (int q = 0; q < num_rule_points; ++q) b += element.fill[q] * divergence_at(gradients_[q]);
  return b;
}

CellMatrix ElementMatrices::mean_dilatation_stiffness(const Element& element) const {
  const CellVector b = divergence(element);
  const double volume = element.volume();
  return deviatoric(element) + element.total_bulk() / (volume * volume) * b * b.transpose();
}

Eigen::Matrix<double, 8, 8> ElementMatrices::mass(const Element& element) const {
  Eigen::Matrix<double, 8, 8> m = Eigen::Matrix<double, 8, 8>::Zero();
  for (int q = 0; q < num_rule_points; ++q) {
    const NodeWeights n = shape_functions(rule_point(q));
    m += element.density[q] * n * n.transpose();
  }
  return m;
}

NodeWeights ElementMatrices::lumped_mass(const Element& element) const { return mass(element).rowwise().sum(); }

}  // namespace hexmesh
