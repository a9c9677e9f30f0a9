// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/QR>

#include "cell_vectors.h"
#include "hexmesh/core/bytes.h"
#include "hexsolver/elastic.h"

namespace hexsolver {
namespace {

constexpr std::size_t lanes = TurnedCells<double>::lanes;

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

double CorotationalCells::energy(const NodeVector& u) const {
  if (!is_linearized_at(u)) return ElasticCells::energy(u);
  double sum = 0;
  for (std::size_t b = 0; b < frames_.size(); ++b) {
    std::array<double, lanes> of_lane{};
    for (std::size_t n = 0; n < 24; ++n)
      for (std::size_t lane = 0; lane < lanes; ++lane)
        of_lane[lane] += 0.5 * (frames_[b].y[n][lane] - rest_[static_cast<Eigen::Index>(n)]) * frames_[b].f[n][lane];
    for (std::size_t lane = 0; lane < mesh_.batches()[b].count; ++lane) sum += of_lane[lane];
  }
  return sum;
}

CorotationalCells::Frame CorotationalCells::still_frame(std::size_t cell, const NodeVector& u) const {
  const CellVector v = mesh_.gather(cell, u);
  const Mat3 one = Mat3::Identity(), none = Mat3::Zero();
  return {one, one, none, none, rest_ + v, times(model(cell).stiffness, v), Vec3::Zero()};
}

std::size_t CorotationalCells::choose_turning(const NodeVector& u, double on, double off) {
  state_.resize(0);
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
  if (is_linearized_at(u)) {
    mesh_.for_each_batch([&](std::size_t b) {
      alignas(64) std::array<double, 24 * lanes> values;
      forces_of_turned(models_of_batch<double>(b), frames_[b], values.data());
      for (std::size_t lane = 0; lane < mesh_.batches()[b].count; ++lane) {
        CellVector force;
        for (std::size_t n = 0; n < 24; ++n) force[static_cast<Eigen::Index>(n)] = values[lanes * n + lane];
        mesh_.scatter_add(mesh_.batches()[b].first + lane, force, gradient);
        mesh_.scatter_add(mesh_.batches()[b].first + lane, force.cwiseAbs(), magnitude);
      }
    });
    return;
  }
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

void CorotationalCells::pack(const Frame& f, TurnedCells<double>& cells, std::size_t lane) {
  const auto put = [lane](auto& of_lanes, const double* values) {
    for (std::size_t n = 0; n < of_lanes.size(); ++n) of_lanes[n][lane] = values[n];
  };
  put(cells.y, f.y.data());
  put(cells.f, f.f.data());
  put(cells.r, f.r.data());
  put(cells.inverse_m, f.inverse_m.data());
  put(cells.a, f.a.data());
  put(cells.h, f.h.data());
}

CorotationalCells::Frame CorotationalCells::unpacked(std::size_t cell) const {
  const std::size_t batch = mesh_.batch_of(cell), lane = cell - mesh_.batches()[batch].first;
  const auto get = [lane](const auto& of_lanes, double* values) {
    for (std::size_t n = 0; n < of_lanes.size(); ++n) values[n] = of_lanes[n][lane];
  };
  const TurnedCells<double>& cells = frames_[batch];
  Frame f;
  get(cells.y, f.y.data());
  get(cells.f, f.f.data());
  get(cells.r, f.r.data());
  get(cells.inverse_m, f.inverse_m.data());
  get(cells.a, f.a.data());
  get(cells.h, f.h.data());
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
  if (clamping == clamping_ && is_linearized_at(u)) return;
  clamping_ = clamping;
  state_ = u;
  single_is_current_ = false;
  const bool clamps = clamping > Hessian::exact && clamping <= Hessian::clamped;
  frames_.resize(mesh_.batches().size());
  positive_.resize(clamps ? mesh_.batches().size() : 0);
  mesh_.for_each_batch([&](std::size_t b) {
    const Mesh::Batch& batch = mesh_.batches()[b];
    for (std::size_t lane = 0; lane < batch.count; ++lane) {
      const std::size_t c = batch.first + lane;
      Frame f = turns(c) ? frame(c, u) : still_frame(c, u);
      if (turns(c) && clamping != Hessian::without_stress) f.a = stress_matrix(f);
      pack(f, frames_[b], lane);
      if (!clamps) continue;
      Columns z = Columns::Zero();
      if (turns(c)) z = positive_part(stress_term(f, model(c).mean_gradient));
      for (int a = 0; a < 8; ++a) z.middleRows<3>(3 * a) = f.r * z.middleRows<3>(3 * a);
      for (std::size_t n = 0; n < 72; ++n) positive_[b].z[n][lane] = static_cast<float>(z.data()[n]);
    }
  });
}

template <>
const std::vector<TurnedCells<double>>& CorotationalCells::frames() const {
  return frames_;
}

template <>
const std::vector<TurnedCells<float>>& CorotationalCells::frames() const {
  if (single_is_current_) return single_frames_;
  static_assert(sizeof(TurnedCells<double>) == 2 * sizeof(TurnedCells<float>));
  constexpr std::size_t numbers = sizeof(TurnedCells<float>) / sizeof(float);
  single_frames_.resize(frames_.size());
  const auto count = static_cast<std::ptrdiff_t>(frames_.size());
#pragma omp parallel for schedule(static) if (mesh_.num_cells() >= Mesh::worth_threads)
  for (std::ptrdiff_t b = 0; b < count; ++b) {
    const double* from = frames_[static_cast<std::size_t>(b)].y[0].data();
    float* to = single_frames_[static_cast<std::size_t>(b)].y[0].data();
    for (std::size_t n = 0; n < numbers; ++n) to[n] = static_cast<float>(from[n]);
  }
  single_is_current_ = true;
  return single_frames_;
}

template <class Real>
LaneModels<Real> CorotationalCells::models_of_batch(std::size_t number) const {
  const Mesh::Batch& batch = mesh_.batches()[number];
  LaneModels<Real> models;
  models.alike = true;
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    const auto& model =
        model_in<Real>(batch.first + std::min(lane, batch.count - 1));  // the last again if there are fewer
    models.stiffness[lane] = model.stiffness.data();
    models.mean_gradient[lane] = model.mean_gradient.data();
    models.alike = models.alike && models.stiffness[lane] == models.stiffness[0];
  }
  return models;
}

template <class Vector>
void CorotationalCells::add_product_of(const Vector& x, Vector& y) const {
  using Real = typename Vector::Scalar;
  static_assert(lanes == Mesh::batch_size && lanes == LaneModels<Real>::lanes);
  need_models<Real>();
  const std::vector<TurnedCells<Real>>& turned = frames<Real>();
  mesh_.for_each_batch([&](std::size_t b) {
    add_turned_product(models_of_batch<Real>(b), turned[b], clamping_ == Hessian::exact,
                       positive_.empty() ? nullptr : &positive_[b], nodes_of_batch(mesh_, b), x.data(), y.data());
  });
}

void CorotationalCells::add_product(const NodeVector& x, NodeVector& y) const { add_product_of(x, y); }
void CorotationalCells::add_product(const FloatNodeVector& x, FloatNodeVector& y) const { add_product_of(x, y); }

std::size_t CorotationalCells::bytes() const {
  return ElasticCells::bytes() + hexmesh::bytes_of(frames_) + hexmesh::bytes_of(single_frames_) +
         hexmesh::bytes_of(positive_) + sizeof(double) * static_cast<std::size_t>(state_.size());
}

void CorotationalCells::add_diagonal(std::size_t cell, NodeBlocks& blocks) const {
  hexsolver::add_diagonal(turns(cell) ? unpacked(cell).r : Mat3(Mat3::Identity()), model(cell).stiffness, blocks);
}

void CorotationalCells::add_cell_hessian(std::size_t cell, CellMatrix& hessian) const {
  const CellMatrix& k = model(cell).stiffness;
  if (!turns(cell)) {
    hessian += k;
    return;
  }
  const Frame f = unpacked(cell);
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
  if (positive_.empty()) return;
  const std::size_t batch = mesh_.batch_of(cell), lane = cell - mesh_.batches()[batch].first;
  Columns z;
  for (std::size_t n = 0; n < 72; ++n) z.data()[n] = static_cast<double>(positive_[batch].z[n][lane]);
  hessian += z * z.transpose();
}

}  // namespace hexsolver
