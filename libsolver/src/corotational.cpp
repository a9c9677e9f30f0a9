// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/QR>

#include "cell_vectors.h"
#include "hexmesh/core/bytes.h"
#include "hexsolver/elastic.h"

namespace hexsolver {
namespace {

Mat3 cross_matrix(const Vec3& v) {
  Mat3 m;
  m << 0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0;
  return m;
}

}  // namespace

CorotationalCells::Frame CorotationalCells::frame(std::size_t cell, const NodeVector& u) const {
  CellVector x = mesh_.gather(cell, u) + rest_;
  Vec3 mean = Vec3::Zero();
  Mat3 f = Mat3::Zero();
  for (int a = 0; a < 8; ++a) mean += x.segment<3>(3 * a) / 8;
  for (int a = 0; a < 8; ++a) {
    x.segment<3>(3 * a) -= mean;
    f += x.segment<3>(3 * a) * model(cell).mean_gradient.row(a);
  }
  const Polar polar = polar_decomposition(f);
  Frame frame{
      polar.rotation, polar.stretch, polar.inverse_m, Mat3::Zero(), rotate(polar.rotation.transpose(), x), {}, {}};
  frame.f = times(model(cell).stiffness, frame.y - rest_);
  Vec3 torque = Vec3::Zero();
  for (int a = 0; a < 8; ++a) torque += Vec3(frame.y.segment<3>(3 * a)).cross(Vec3(frame.f.segment<3>(3 * a)));
  frame.h = polar.inverse_m * torque;
  return frame;
}

double CorotationalCells::cell_energy(std::size_t cell, const NodeVector& u) const {
  if (!turns(cell)) {
    const CellVector v = mesh_.gather(cell, u);
    return 0.5 * v.dot(times(model(cell).stiffness, v));
  }
  const Frame f = frame(cell, u);
  return 0.5 * (f.y - rest_).dot(f.f);
}

std::size_t CorotationalCells::choose_turning(const NodeVector& u, double on, double off) {
  turning_.resize(mesh_.num_cells());
  std::size_t count = 0;
  for (std::size_t c = 0; c < turning_.size(); ++c) {
    const double angle = rotation_angle(polar_decomposition(mean_gradient(c, u)).rotation);
    turning_[c] = angle > (turning_[c] ? off : on);
    count += turning_[c];
  }
  return count;
}

Mat3 CorotationalCells::stress(std::size_t cell, const NodeVector& u) const {
  const Mat3 f = mean_gradient(cell, u);
  if (!turns(cell)) return hooke_stress(model(cell), (f + f.transpose()) / 2 - Mat3::Identity());
  const Polar polar = polar_decomposition(f);
  const Mat3 in_frame = hooke_stress(model(cell), polar.stretch - Mat3::Identity());
  return polar.rotation * in_frame * polar.rotation.transpose();
}

void CorotationalCells::add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const {
  mesh_.for_each_cell([&](std::size_t c) {
    if (!turns(c)) {
      const CellVector linear = times(model(c).stiffness, mesh_.gather(c, u));
      mesh_.scatter_add(c, linear, gradient);
      mesh_.scatter_add(c, linear.cwiseAbs(), magnitude);
      return;
    }
    Frame f = frame(c, u);
    for (int a = 0; a < 8; ++a) f.f.segment<3>(3 * a) -= f.h.cross(Vec3(model(c).mean_gradient.row(a)));
    const CellVector force = rotate(f.r, f.f);
    mesh_.scatter_add(c, force, gradient);
    mesh_.scatter_add(c, force.cwiseAbs(), magnitude);
  });
}

CorotationalCells::StressTerm CorotationalCells::stress_term(const Frame& f, const NodeGradients& gradient) {
  StressTerm e;
  e.a = f.a;
  for (int a = 0; a < 8; ++a) {
    const Vec3 ga = gradient.row(a), fa = f.f.segment<3>(3 * a);
    e.t.block<3, 3>(0, 3 * a) = f.inverse_m * cross_matrix(ga);
    e.l.block<3, 3>(0, 3 * a) = f.h * ga.transpose() - ga * f.h.transpose() + cross_matrix(fa);
  }
  return e;
}

Mat3 CorotationalCells::stress_matrix(const Frame& f) {
  const Eigen::Map<const Eigen::Matrix<double, 3, 8>> y(f.y.data()), force(f.f.data());
  const Mat3 yf = y * force.transpose(), a = yf - cross_matrix(f.h) * f.s;
  Mat3 out = 0.5 * (a + a.transpose());
  out.diagonal().array() -= yf.trace();
  return out;
}

TurnedCell CorotationalCells::packed(const Frame& f) {
  TurnedCell cell;
  Eigen::Map<Mat3>(cell.r.data()) = f.r;
  Eigen::Map<Mat3>(cell.inverse_m.data()) = f.inverse_m;
  Eigen::Map<Mat3>(cell.a.data()) = f.a;
  Eigen::Map<Vec3>(cell.h.data()) = f.h;
  Eigen::Map<NodeGradients>(cell.y.data()) = Eigen::Map<const Eigen::Matrix<double, 3, 8>>(f.y.data()).transpose();
  Eigen::Map<NodeGradients>(cell.f.data()) = Eigen::Map<const Eigen::Matrix<double, 3, 8>>(f.f.data()).transpose();
  return cell;
}

CorotationalCells::Frame CorotationalCells::unpacked(const TurnedCell& cell) {
  Frame f;
  f.r = Eigen::Map<const Mat3>(cell.r.data());
  f.inverse_m = Eigen::Map<const Mat3>(cell.inverse_m.data());
  f.a = Eigen::Map<const Mat3>(cell.a.data());
  f.h = Eigen::Map<const Vec3>(cell.h.data());
  Eigen::Map<Eigen::Matrix<double, 3, 8>>(f.y.data()) = Eigen::Map<const NodeGradients>(cell.y.data()).transpose();
  Eigen::Map<Eigen::Matrix<double, 3, 8>>(f.f.data()) = Eigen::Map<const NodeGradients>(cell.f.data()).transpose();
  return f;
}

CorotationalCells::Columns CorotationalCells::positive_part(const StressTerm& e) {
  // E = W^T C W with W = [T; L] and C = [[A, 1], [1, 0]]; in an orthonormal basis of W's rows it is 6 x 6.
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  Eigen::Matrix<double, 24, 6> w;
  w << e.t.transpose(), e.l.transpose();
  Matrix6 c = Matrix6::Zero();
  c.topLeftCorner<3, 3>() = e.a;
  c.topRightCorner<3, 3>().setIdentity();
  c.bottomLeftCorner<3, 3>().setIdentity();
  const Eigen::HouseholderQR<Eigen::Matrix<double, 24, 6>> qr(w);
  const Matrix6 r = qr.matrixQR().topRows<6>().triangularView<Eigen::Upper>();
  const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(r * c * r.transpose());
  Eigen::Matrix<double, 24, 3> z = Eigen::Matrix<double, 24, 3>::Zero();
  z.topRows<6>() =
      eigen.eigenvectors().rightCols<3>() * eigen.eigenvalues().tail<3>().cwiseMax(0).cwiseSqrt().asDiagonal();
  return qr.householderQ() * z;
}

void CorotationalCells::linearize(const NodeVector& u, double clamping) {
  clamping_ = clamping;
  const bool clamps = clamping > Hessian::exact && clamping <= Hessian::clamped;
  frames_.resize(mesh_.num_cells());
  positive_.resize(clamps ? mesh_.num_cells() : 0);
  mesh_.for_each_cell([&](std::size_t c) {
    if (!turns(c)) return;
    Frame f = frame(c, u);
    if (clamping != Hessian::without_stress) f.a = stress_matrix(f);
    frames_[c] = packed(f);
    if (!clamps) return;
    positive_[c] = positive_part(stress_term(f, model(c).mean_gradient));
    for (int a = 0; a < 8; ++a) positive_[c].middleRows<3>(3 * a) = f.r * positive_[c].middleRows<3>(3 * a);
  });
}

void CorotationalCells::add_product(const NodeVector& x, NodeVector& y) const {
  mesh_.for_each_cell([&](std::size_t c) {
    if (!turns(c)) {
      mesh_.scatter_add(c, times(model(c).stiffness, mesh_.gather(c, x)), y);
      return;
    }
    const CellVector v = mesh_.gather(c, x);
    CellVector out;
    multiply_turned(model(c).stiffness.data(), model(c).mean_gradient.data(), frames_[c], clamping_ == Hessian::exact,
                    v.data(), out.data());
    if (!positive_.empty()) out += positive_[c] * (positive_[c].transpose() * v);
    mesh_.scatter_add(c, out, y);
  });
}

std::size_t CorotationalCells::bytes() const {
  return ElasticCells::bytes() + hexmesh::bytes_of(frames_) + hexmesh::bytes_of(positive_);
}

void CorotationalCells::add_diagonal(std::size_t cell, NodeBlocks& blocks) const {
  hexsolver::add_diagonal(turns(cell) ? unpacked(frames_[cell]).r : Mat3(Mat3::Identity()), model(cell).stiffness,
                          blocks);
}

void CorotationalCells::add_cell_hessian(std::size_t cell, CellMatrix& hessian) const {
  const CellMatrix& k = model(cell).stiffness;
  if (!turns(cell)) {
    hessian += k;
    return;
  }
  const Frame f = unpacked(frames_[cell]);
  const StressTerm e = stress_term(f, model(cell).mean_gradient);
  Columns y;  // w x y_a = (Y w)_a
  for (int a = 0; a < 8; ++a) y.block<3, 3>(3 * a, 0) = -cross_matrix(f.y.segment<3>(3 * a));
  // (1 - Y T)^T K (1 - Y T) = K - B^T - B with B = T^T (Y^T K - Y^T K Y T / 2)
  const Columns ky = k * y;
  Eigen::Matrix<double, 3, 24> inner = 0.5 * (y.transpose() * ky) * e.t - ky.transpose();
  if (clamping_ == Hessian::exact) inner += e.l + 0.5 * e.a * e.t;
  CellMatrix h = k;
  const CellMatrix half = e.t.transpose() * inner;
  h += half + half.transpose();
  hessian += rotate(f.r, h);
  if (!positive_.empty()) hessian += positive_[cell] * positive_[cell].transpose();
}

}  // namespace hexsolver
