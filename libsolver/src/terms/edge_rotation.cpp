// SPDX-License-Identifier: Apache-2.0
#include "terms/edge_rotation.h"

#include <Eigen/LU>

#include "core/rotation.h"
#include "hexmesh/core/bytes.h"
#include "kernels/cell_vectors.h"

namespace hexsolver {

Mat3 EdgeRotatedCells::rotation(std::size_t cell, const CellVector& moved) const {
  // Averages of the four edges along each axis [mm].
  Mat3 now = Mat3::Zero();
  for (int axis = 0; axis < 3; ++axis)
    for (int a = 0; a < 8; ++a)
      now.col(axis) += (hexmesh::corner_bit(a, axis) ? 0.25 : -0.25) * (moved + unstressed(cell)).segment<3>(3 * a);
  return orthonormalized(now) * orthonormalized(mesh_.edges(cell)).transpose();
}

double EdgeRotatedCells::cell_energy(std::size_t cell, const NodeVector& u) const {
  const CellVector moved = mesh_.gather(cell, u);
  const CellVector e =
      rotate(rotation(cell, moved).transpose(), CellVector(moved + unstressed(cell))) - unstressed(cell);
  return 0.5 * e.dot(times(model(cell).stiffness, e));
}

Mat3 EdgeRotatedCells::stress(std::size_t cell, const NodeVector& u) const {
  const Mat3 r = rotation(cell, mesh_.gather(cell, u));
  const Mat3 f = mean_gradient(cell, u), in_frame = r.transpose() * f;
  const Mat3 kirchhoff =
      r * hooke_stress(model(cell), (in_frame + in_frame.transpose()) / 2 - Mat3::Identity()) * f.transpose();
  return cauchy_stress((kirchhoff + kirchhoff.transpose()) / 2, f.determinant());  // its cells have a torque besides
}

void EdgeRotatedCells::add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const {
  mesh_.for_each_cell([&](std::size_t c) {
    const CellVector moved = mesh_.gather(c, u);
    const Mat3 r = rotation(c, moved);
    const CellVector e = rotate(r.transpose(), CellVector(moved + unstressed(c))) - unstressed(c);
    const CellVector force = rotate(r, times(model(c).stiffness, e));
    mesh_.scatter_add(c, force, gradient);
    mesh_.scatter_add(c, force.cwiseAbs(), magnitude);
  });
}

void EdgeRotatedCells::linearize(const NodeVector& u, double /*projection*/) {
  rotations_.resize(mesh_.num_cells());
  mesh_.for_each_cell([&](std::size_t c) { rotations_[c] = rotation(c, mesh_.gather(c, u)); });
}

template <class Vector>
void EdgeRotatedCells::add_product_of(const Vector& x, Vector& y) const {
  using Real = typename Vector::Scalar;
  mesh_.for_each_cell([&](std::size_t c) {
    const CellVector v = rotate(rotations_[c].transpose(), mesh_.gather(c, x).template cast<double>().eval());
    mesh_.scatter_add(c, rotate(rotations_[c], times(model(c).stiffness, v)).template cast<Real>().eval(), y);
  });
}

void EdgeRotatedCells::add_product(const NodeVector& x, NodeVector& y) const { add_product_of(x, y); }
void EdgeRotatedCells::add_product(const FloatNodeVector& x, FloatNodeVector& y) const { add_product_of(x, y); }

std::size_t EdgeRotatedCells::bytes() const { return ElasticCells::bytes() + hexmesh::bytes_of(rotations_); }

void EdgeRotatedCells::add_diagonal(std::size_t cell, NodeBlocks& blocks) const {
  hexsolver::add_diagonal(rotations_[cell], model(cell).stiffness, blocks);
}

void EdgeRotatedCells::add_cell_hessian(std::size_t cell, CellMatrix& h) const {
  h += rotate(rotations_[cell], model(cell).stiffness);
}

}  // namespace hexsolver
