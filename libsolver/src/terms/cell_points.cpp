// SPDX-License-Identifier: Apache-2.0
#include "terms/cell_points.h"

#include <Eigen/LU>

#include "kernels/cell_hessian.h"

namespace hexsolver {
namespace {

using Nodes = Eigen::Matrix<double, 3, 8>;  ///< a vector for each node

/// 2 mu dev(e) + kappa tr(e) with e = sym(h), the integrals of a point for mu and kappa.
Mat3 hooke(double shear, double bulk, const Mat3& h) {
  return shear * (h + h.transpose()) + (bulk - 2 * shear / 3) * h.trace() * Mat3::Identity();
}

}  // namespace

CellPoints make_cell_points(const std::vector<hexmesh::MaterialPoint>& points, const Mat3& edges) {
  const Mat3 inverse = edges.inverse();
  CellPoints out;
  for (const hexmesh::MaterialPoint& p : points)
    out.push_back({hexmesh::shape_gradients(p.local) * inverse, p.volume, p.shear, p.bulk});
  return out;
}

bool reshape(const CellPoints& on_lattice, const CellVector& to_rest, CellPoints& out) {
  const Eigen::Map<const Nodes> moved(to_rest.data());
  out.resize(on_lattice.size());
  for (std::size_t p = 0; p < out.size(); ++p) {
    const CellPoint& from = on_lattice[p];
    const Mat3 f = Mat3::Identity() + moved * from.gradient;
    const double jacobian = f.determinant();
    if (!(jacobian > 0)) return false;
    out[p] = {from.gradient * f.inverse(), jacobian * from.volume, jacobian * from.shear, jacobian * from.bulk};
  }
  return true;
}

PointMeans means(const CellPoints& points) {
  PointMeans out{NodeGradients::Zero()};
  for (const CellPoint& p : points) {
    out.gradient += p.volume * p.gradient;
    out.volume += p.volume;
    out.shear += p.shear;
    out.bulk += p.bulk;
  }
  out.gradient /= out.volume;
  return out;
}

CellMatrix stiffness_by_points(const CellPoints& points, bool mean_dilatation) {
  CellMatrix k = CellMatrix::Zero();
  for (const CellPoint& p : points) {
    // h = grad v of each dof and the stress of that; entries (i, j) at i + 3 j
    Eigen::Matrix<double, 9, 24, Eigen::RowMajor> h = Eigen::Matrix<double, 9, 24, Eigen::RowMajor>::Zero(), stress;
    for (int a = 0; a < 8; ++a)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) h(i + 3 * j, 3 * a + i) = p.gradient(a, j);
    const double lambda = (mean_dilatation ? 0 : p.bulk) - 2 * p.shear / 3;
    const Eigen::Matrix<double, 1, 24> divergence = lambda * (h.row(0) + h.row(4) + h.row(8));
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        stress.row(i + 3 * j) = p.shear * (h.row(i + 3 * j) + h.row(j + 3 * i));
        if (i == j) stress.row(i + 3 * j) += divergence;
      }
    add_products24(h.data(), stress.data(), k.data());
  }
  if (mean_dilatation) {
    const PointMeans mean = means(points);
    const Nodes transposed = mean.gradient.transpose();
    const Eigen::Map<const CellVector> b(transposed.data());
    k += mean.bulk * b * b.transpose();
  }
  return k;
}

CellVector forces_by_points(const CellPoints& points, bool mean_dilatation, const CellVector& v) {
  const Eigen::Map<const Nodes> moved(v.data());
  CellVector out = CellVector::Zero();
  Eigen::Map<Nodes> of_node(out.data());
  for (const CellPoint& p : points)
    of_node.noalias() += hooke(p.shear, mean_dilatation ? 0 : p.bulk, moved * p.gradient) * p.gradient.transpose();
  if (mean_dilatation) {
    const PointMeans mean = means(points);
    of_node.noalias() += mean.bulk * (moved * mean.gradient).trace() * mean.gradient.transpose();
  }
  return out;
}

}  // namespace hexsolver
