// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <numeric>

#include "cell_vectors.h"
#include "hexmesh/core/bytes.h"
#include "hexsolver/elastic.h"
#include "single_models.h"

namespace hexsolver {
namespace {

constexpr std::size_t lanes = TurnedCells<double>::lanes;

/// Frames come from memory once and in order, but in more streams than a machine follows by itself.
template <class Real>
void fetch(const std::vector<TurnedCells<Real>>& frames, std::size_t batch) {
  if (batch >= frames.size()) return;
  constexpr std::size_t line = 64;
  for (std::size_t n = 0; n < sizeof(TurnedCells<Real>); n += line)
    __builtin_prefetch(reinterpret_cast<const char*>(&frames[batch]) + n);
}

std::array<double, 6> upper(const Mat3& m) { return {m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2)}; }
Mat3 symmetric(const std::array<double, 6>& m) {
  Mat3 out;
  out << m[0], m[1], m[2], m[1], m[3], m[4], m[2], m[4], m[5];
  return out;
}

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
  if (!is_at(u)) return ElasticCells::energy(u);
  energies_.resize(mesh_.batches().size());
  mesh_.for_each_batch([&](std::size_t b) {
    TurnedCells<double> space;
    const TurnedCells<double>& cells = turned(b, space);
    std::array<double, lanes> of_lane{};
    for (std::size_t n = 0; n < 24; ++n)
      for (std::size_t lane = 0; lane < lanes; ++lane)
        of_lane[lane] += 0.5 * (cells.y[n][lane] - rest_[static_cast<Eigen::Index>(n)]) * cells.f[n][lane];
    energies_[b] = std::accumulate(of_lane.data(), of_lane.data() + mesh_.batches()[b].count, 0.0);
  });
  return sum_of_energies();
}

CorotationalCells::Frame CorotationalCells::still_frame(std::size_t cell, const NodeVector& u) const {
  const CellVector v = mesh_.gather(cell, u);
  const Mat3 one = Mat3::Identity(), none = Mat3::Zero();
  return {one, one, none, none, rest_ + v, times(model(cell).stiffness, v), Vec3::Zero()};
}

std::size_t CorotationalCells::choose_turning(const NodeVector& u, double on, double off) {
  forget_state();
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
  if (is_at(u)) {
    mesh_.for_each_batch([&](std::size_t b) {
      alignas(64) std::array<double, 24 * lanes> values;
      TurnedCells<double> space;
      forces_of_turned(models_of_batch<double>(b), turned(b, space), values.data());
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
  put(cells.inverse_m, upper(f.inverse_m).data());
  put(cells.a, upper(f.a).data());
  put(cells.h, f.h.data());
}

CorotationalCells::Frame CorotationalCells::kept_frame(std::size_t cell) const {
  if (saves_memory_) return frame_of_state(cell);
  const std::size_t batch = mesh_.batch_of(cell);
  return unpacked(frames_[batch], cell - mesh_.batches()[batch].first);
}

CorotationalCells::Frame CorotationalCells::unpacked(const TurnedCells<double>& cells, std::size_t lane) {
  const auto get = [lane](const auto& of_lanes, double* values) {
    for (std::size_t n = 0; n < of_lanes.size(); ++n) values[n] = of_lanes[n][lane];
  };
  Frame f;
  get(cells.y, f.y.data());
  get(cells.f, f.f.data());
  get(cells.r, f.r.data());
  std::array<double, 6> inverse_m, a;
  get(cells.inverse_m, inverse_m.data());
  get(cells.a, a.data());
  f.inverse_m = symmetric(inverse_m);
  f.a = symmetric(a);
  get(cells.h, f.h.data());
  return f;
}

CorotationalCells::PositivePart CorotationalCells::positive_part(const StressTerm& e) {
  // E = T^T N + N^T T with N = L + A T / 2 is (P^T P - M^T M) / 2 with P, M = S T +- S^-T N for any S. P^T P + M^T M is
  // least, and what is kept nearest to the positive part, where S^T S is the geometric mean of (T T^T)^-1 and N N^T.
  constexpr double nothing = 1e-12;  // of the largest
  const Eigen::Matrix<double, 3, 24> n = e.l + (0.5 * e.a).lazyProduct(e.t);
  Eigen::SelfAdjointEigenSolver<Mat3> of_t, of_both;
  of_t.computeDirect(e.t.lazyProduct(e.t.transpose()));
  const Vec3 sizes = of_t.eigenvalues().cwiseMax(nothing * of_t.eigenvalues()[2]).cwiseSqrt();
  const Mat3& q = of_t.eigenvectors();
  const Mat3 root = q * sizes.asDiagonal() * q.transpose(),
             inverse = q * sizes.cwiseInverse().asDiagonal() * q.transpose();
  const Mat3 nn = n.lazyProduct(n.transpose());
  of_both.computeDirect(root * nn * root);
  PositivePart z;
  for (int i = 0; i < 3; ++i) {
    const double squared = of_both.eigenvalues()[i];
    if (!(squared > nothing * of_both.eigenvalues()[2]) || !(sizes[0] > 0)) continue;
    const double scale = std::sqrt(0.5 * std::sqrt(squared));
    const Vec3 v = of_both.eigenvectors().col(i);
    z.c.col(i) = 1 / (2 * scale) * (root * v);
    z.b.col(i) = scale * (inverse * v) + 0.5 * (e.a * z.c.col(i));
  }
  return z;
}

void CorotationalCells::keep_state(const NodeVector& u, bool stressed) {
  if (is_at(u) && (is_stressed_ || !stressed)) return;
  is_stressed_ = stressed;
  state_ = u;
  positive_.clear();
  single_is_current_ = false;
  if (saves_memory_) return;
  frames_.resize(mesh_.batches().size());
  mesh_.for_each_batch([&](std::size_t b) { turn(b, frames_[b]); });
}

void CorotationalCells::move_to(const NodeVector& u) { keep_state(u, true); }

void CorotationalCells::linearize(const NodeVector& u, double clamping) {
  keep_state(u, clamping != Hessian::without_stress);
  clamping_ = clamping;
  if (clamping > Hessian::exact && clamping <= Hessian::clamped)
    clamp();
  else
    positive_.clear();
}

void CorotationalCells::clamp() {
  if (!positive_.empty()) return;
  positive_.resize(mesh_.batches().size());
  mesh_.for_each_batch([&](std::size_t b) {
    const Mesh::Batch& batch = mesh_.batches()[b];
    TurnedCells<double> space;
    const TurnedCells<double>& cells = turned(b, space);
    for (std::size_t lane = 0; lane < batch.count; ++lane) {
      const std::size_t c = batch.first + lane;
      PositivePart part;
      if (turns(c)) part = positive_part(stress_term(unpacked(cells, lane), model(c).mean_gradient));
      for (std::size_t n = 0; n < 9; ++n) {
        positive_[b].b[n][lane] = static_cast<float>(part.b.data()[n]);
        positive_[b].c[n][lane] = static_cast<float>(part.c.data()[n]);
      }
    }
  });
}

CorotationalCells::Frame CorotationalCells::frame_of_state(std::size_t cell) const {
  if (!turns(cell)) return still_frame(cell, state_);
  Frame f = frame(cell, state_);
  if (is_stressed_) f.a = stress_matrix(f);
  return f;
}

bool CorotationalCells::turns_somewhere(std::size_t batch) const {
  const Mesh::Batch& cells = mesh_.batches()[batch];
  for (std::size_t c = cells.first; c < cells.first + cells.count; ++c)
    if (turns(c)) return true;
  return false;
}

void CorotationalCells::turn(std::size_t batch, TurnedCells<double>& cells) const {
  const auto [first, count] = std::pair(mesh_.batches()[batch].first, mesh_.batches()[batch].count);
  unsigned left = (1U << lanes) - 1;
  if (turns_somewhere(batch))
    left = turn_cells(models_of_batch<double>(batch), is_stressed_, nodes_of_batch(mesh_, batch), rest_.data(),
                      state_.data(), cells);
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    const std::size_t cell = first + std::min(lane, count - 1);
    if (left >> lane & 1U || !turns(cell)) pack(frame_of_state(cell), cells, lane);
  }
}

const TurnedCells<double>& CorotationalCells::turned(std::size_t batch, TurnedCells<double>& space) const {
  if (!saves_memory_) return frames_[batch];
  turn(batch, space);
  return space;
}

const TurnedCells<float>& CorotationalCells::turned(std::size_t batch, TurnedCells<float>& /*space*/) const {
  return single_frames_[batch];
}

void CorotationalCells::keep_single_frames() const {
  if (single_is_current_) return;
  static_assert(sizeof(TurnedCells<double>) == 2 * sizeof(TurnedCells<float>));
  constexpr std::size_t numbers = sizeof(TurnedCells<float>) / sizeof(float);
  single_frames_.resize(mesh_.batches().size());
  mesh_.for_each_batch([&](std::size_t b) {
    TurnedCells<double> space;
    const double* from = turned(b, space).y[0].data();
    float* to = single_frames_[b].y[0].data();
    for (std::size_t n = 0; n < numbers; ++n) to[n] = static_cast<float>(from[n]);
  });
  single_is_current_ = true;
}

template <class Real>
LaneModels<Real> CorotationalCells::models_of_batch(std::size_t number) const {
  const Mesh::Batch& batch = mesh_.batches()[number];
  LaneModels<Real> models;
  const auto cell_of = [&](std::size_t lane) {
    return batch.first + std::min(lane, batch.count - 1);  // the last again if there are fewer
  };
  if constexpr (std::is_same_v<Real, double>) {
    bool alike = true;
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      const ElementModel& m = model(cell_of(lane));
      models.stiffness[lane] = m.stiffness.data();
      models.mean_gradient[lane] = m.mean_gradient.data();
      alike = alike && models.stiffness[lane] == models.stiffness[0];
    }
    if (alike) models.alike = models.stiffness[0];
  } else {
    const SingleModels& single = single_models();
    models.alike = single.stiffness.alike(number);
    if (!models.alike) models.packed = &single.stiffness.packed(number);
    for (std::size_t lane = 0; lane < lanes; ++lane)
      models.mean_gradient[lane] = single.mean_gradient[static_cast<std::size_t>(elements_[cell_of(lane)])].data();
  }
  return models;
}

template <class Vector>
void CorotationalCells::add_product_of(const Vector& x, Vector& y) const {
  using Real = typename Vector::Scalar;
  static_assert(lanes == Mesh::batch_size && lanes == LaneModels<Real>::lanes);
  if (std::is_same_v<Real, float>) {
    single_models();
    keep_single_frames();
  }
  mesh_.for_each_batch([&](std::size_t b) {
    TurnedCells<Real> space;
    fetch(kept_frames<Real>(), b + 1);
    add_turned_product(models_of_batch<Real>(b), turned(b, space), clamping_ == Hessian::exact,
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
  hexsolver::add_diagonal(turns(cell) ? kept_frame(cell).r : Mat3(Mat3::Identity()), model(cell).stiffness, blocks);
}

/// b . Q v = b . R^T v: the part of Q from the change of R has no trace.
Dilatation CorotationalCells::dilatation(std::size_t cell) const {
  return dilatation_turned(cell, turns(cell) ? kept_frame(cell).r : Mat3(Mat3::Identity()));
}

void CorotationalCells::add_cell_hessian(std::size_t cell, CellMatrix& hessian) const {
  const CellMatrix& k = model(cell).stiffness;
  if (!turns(cell)) {
    hessian += k;
    return;
  }
  const Frame f = kept_frame(cell);
  const StressTerm e = stress_term(f, model(cell).mean_gradient);
  Eigen::Matrix<double, 24, 3> y, ky;  // w x y_a = (Y w)_a
  for (int a = 0; a < 8; ++a) y.block<3, 3>(3 * a, 0) = -cross_matrix(f.y.segment<3>(3 * a));
  for (int column = 0; column < 3; ++column) ky.col(column) = times(k, y.col(column));
  // (1 - Y T)^T K (1 - Y T) = K - B^T - B with B = T^T (Y^T K - Y^T K Y T / 2)
  const Mat3 yky = y.transpose().lazyProduct(ky);
  const Rows t = e.t;
  Rows inner = (0.5 * yky).lazyProduct(e.t) - ky.transpose();
  if (clamping_ == Hessian::exact) inner += e.l + (0.5 * e.a).lazyProduct(e.t);
  Rows z;
  if (!positive_.empty()) {
    const std::size_t batch = mesh_.batch_of(cell), lane = cell - mesh_.batches()[batch].first;
    PositivePart part;
    for (std::size_t n = 0; n < 9; ++n) {
      part.b.data()[n] = static_cast<double>(positive_[batch].b[n][lane]);
      part.c.data()[n] = static_cast<double>(positive_[batch].c[n][lane]);
    }
    z = part.b.transpose().lazyProduct(e.t) + part.c.transpose().lazyProduct(e.l);
  }
  add_turned_hessian(k.data(), t.data(), inner.data(), positive_.empty() ? nullptr : z.data(), f.r.data(),
                     hessian.data());
}

}  // namespace hexsolver
