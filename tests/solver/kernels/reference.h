// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Dense>

#include "kernels/rotated_cells.h"
#include "support/bodies.h"

/// What kernels do with eight cells at once, done plainly with one: THEORY.md, "Co-rotational cells".
namespace testing_support::reference {

using hexsolver::CellMatrix;
using hexsolver::CellVector;
using hexsolver::Mesh;
using hexsolver::NodeGradients;
using hexsolver::NodeVector;
using Rows = Eigen::Matrix<double, 3, 24>;

/// y += K x of the cells of a batch.
/// @param matrix_of  cell -> K
template <class MatrixOf>
void add_product(const Mesh& mesh, const Mesh::Batch& batch, const MatrixOf& matrix_of, const NodeVector& x,
                 NodeVector& y) {
  for (std::size_t c = batch.first; c < batch.end(); ++c)
    mesh.scatter_add(c, CellVector(matrix_of(c) * mesh.gather(c, x)), y);
}

inline Mat3 cross_matrix(const Vec3& v) {
  Mat3 m;
  m << 0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0;
  return m;
}

/// One co-rotational cell in its frame; the letters are those of THEORY.md.
struct Frame {
  CellVector y, f;
  Mat3 r, inverse_m, a;
  Vec3 h;
};

/// The frame of a cell.
/// @param x     corners where displaced
/// @param rest  corners relative to the centre of the cell
inline Frame frame(const CellMatrix& k, const CellVector& x, const CellVector& rest, const Mat3& rotation,
                   const Mat3& stretch, const Mat3& inverse_m) {
  Frame out;
  out.r = rotation;
  out.inverse_m = inverse_m;
  const Eigen::Map<const Eigen::Matrix<double, 3, 8>> corners(x.data());
  const Vec3 mean = corners.rowwise().mean();
  for (int a = 0; a < 8; ++a) out.y.segment<3>(3 * a) = rotation.transpose() * (corners.col(a) - mean);
  out.f = k * (out.y - rest);
  Vec3 torque = Vec3::Zero();
  Mat3 yf = Mat3::Zero();
  for (int a = 0; a < 8; ++a) {
    const Vec3 y = out.y.segment<3>(3 * a), f = out.f.segment<3>(3 * a);
    torque += y.cross(f);
    yf += y * f.transpose();
  }
  out.h = inverse_m * torque;
  const Mat3 a = yf - cross_matrix(out.h) * stretch;
  out.a = (a + a.transpose()) / 2 - yf.trace() * Mat3::Identity();
  return out;
}

/// T and L of the stress term E = T^T A T + T^T L + L^T T.
inline Rows t_of(const Frame& c, const NodeGradients& g) {
  Rows t;
  for (int a = 0; a < 8; ++a) t.block<3, 3>(0, 3 * a) = c.inverse_m * cross_matrix(g.row(a));
  return t;
}
inline Rows l_of(const Frame& c, const NodeGradients& g) {
  Rows l;
  for (int a = 0; a < 8; ++a) {
    const Vec3 ga = g.row(a);
    l.block<3, 3>(0, 3 * a) = c.h * ga.transpose() - ga * c.h.transpose() + cross_matrix(c.f.segment<3>(3 * a));
  }
  return l;
}

/// R (Q^T K Q + E) R^T, Q = 1 + Y T with Y_a = [y_a]x.
inline CellMatrix rotated_hessian(const CellMatrix& k, const Frame& c, const NodeGradients& g, const CellMatrix& e) {
  const Rows t = t_of(c, g);
  Eigen::Matrix<double, 24, 3> y;
  CellMatrix r = CellMatrix::Zero();
  for (int a = 0; a < 8; ++a) {
    y.block<3, 3>(3 * a, 0) = cross_matrix(c.y.segment<3>(3 * a));
    r.block<3, 3>(3 * a, 3 * a) = c.r;
  }
  const CellMatrix q = CellMatrix::Identity() + y * t;
  return r * (q.transpose() * k * q + e) * r.transpose();
}

}  // namespace testing_support::reference
