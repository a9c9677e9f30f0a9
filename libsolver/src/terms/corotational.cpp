// SPDX-License-Identifier: Apache-2.0
#include "terms/corotational.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <numeric>

#include "core/rotation.h"
#include "hexmesh/core/bytes.h"
#include "kernels/cell_hessian.h"
#include "kernels/cell_vectors.h"
#include "terms/single_models.h"

namespace hexsolver {
namespace {

constexpr std::size_t lanes = RotatedCells<double>::lanes;

/// Frames come from memory once and in order, but in more streams than a machine follows by itself.
template <class Real>
void fetch(const std::vector<RotatedCells<Real>>& frames, std::size_t batch) {
  if (batch >= frames.size()) return;
  constexpr std::size_t line = 64;
  for (std::size_t n = 0; n < sizeof(RotatedCells<Real>); n += line)
    __builtin_prefetch(reinterpret_cast<const char*>(&frames[batch]) + n);
}

}  // namespace

CorotationalFrame CorotationalCells::place(const NodeGradients& mean_gradient, const CellVector& rest,
                                           const CellVector& moved) {
  CellVector x = moved + rest;
  Vec3 mean = Vec3::Zero();
  Mat3 f = Mat3::Zero();
  for (int a = 0; a < 8; ++a) mean += x.segment<3>(3 * a) / 8;
  for (int a = 0; a < 8; ++a) {
    x.segment<3>(3 * a) -= mean;
    f += x.segment<3>(3 * a) * mean_gradient.row(a);
  }
  const Polar polar = polar_decomposition(f);
  return {polar.rotation, polar.stretch, polar.inverse_m, Mat3::Zero(), rotate(polar.rotation.transpose(), x), {}, {}};
}

void CorotationalCells::add_forces(const CellVector& forces, CorotationalFrame& frame) {
  frame.f = forces;
  Vec3 torque = Vec3::Zero();
  for (int a = 0; a < 8; ++a) torque += Vec3(frame.y.segment<3>(3 * a)).cross(Vec3(frame.f.segment<3>(3 * a)));
  frame.h = frame.inverse_m * torque;
}

CorotationalFrame CorotationalCells::frame(std::size_t cell, const NodeVector& u) const {
  if (!rotates(cell)) return unrotated_frame(cell, u, kept_rotation(cell));
  const CellVector at_rest = unstressed(cell);
  CorotationalFrame frame = place(model(cell).mean_gradient, at_rest, moved(cell, u));
  add_forces(times(model(cell).stiffness, frame.y - at_rest), frame);
  return frame;
}

bool CorotationalCells::set_rest(const NodeVector& to_rest) {
  forget_state();
  return ElasticCells::set_rest(to_rest);
}

/// As frame(), by the points in place of K, which would take longer to form.
std::optional<CellVector> CorotationalCells::force_on_lattice(std::size_t cell, const CellVector& to_unstressed) const {
  CellPoints here;
  if (!reshape(points_on_lattice(cell), to_unstressed, here)) return {};
  const NodeGradients mean_gradient = means(here).gradient;
  const CellVector at_rest = corners(cell) + to_unstressed;
  CorotationalFrame frame = place(mean_gradient, at_rest, -to_unstressed);
  add_forces(forces_by_points(here, model(cell).mean_dilatation, frame.y - at_rest), frame);
  return force(frame, mean_gradient);
}

double CorotationalCells::energy_in(const CorotationalFrame& f, std::size_t cell) const {
  return 0.5 * (f.y - unstressed(cell)).dot(f.f);
}

double CorotationalCells::cell_energy(std::size_t cell, const NodeVector& u) const {
  if (is_straight(cell)) {
    const CellVector v = moved(cell, u);
    return 0.5 * v.dot(times(model(cell).stiffness, v));
  }
  return energy_in(frame(cell, u), cell);
}

double CorotationalCells::energy(const NodeVector& u) const {
  if (!is_at(u)) return ElasticCells::energy(u);
  energies_.resize(mesh_.batches().size());
  mesh_.for_each_batch([&](std::size_t b) {
    RotatedCells<double> space;
    const RotatedCells<double>& cells = rotated(b, space);
    const RestOfLanes at_rest = rest_of_batch(b);
    std::array<double, lanes> of_lane{};
    for (std::size_t n = 0; n < 24; ++n)
      for (std::size_t lane = 0; lane < lanes; ++lane)
        of_lane[lane] += 0.5 * (cells.y[n][lane] - at_rest[n][lane]) * cells.f[n][lane];
    energies_[b] = std::accumulate(of_lane.data(), of_lane.data() + mesh_.batches()[b].count, 0.0);
  });
  return sum_of_energies();
}

Mat3 CorotationalCells::kept_rotation(std::size_t cell) const {
  const auto held = held_.find(cell);
  return held == held_.end() ? Mat3(Mat3::Identity()) : held->second;
}

CorotationalFrame CorotationalCells::unrotated_frame(std::size_t cell, const NodeVector& u, const Mat3& r) const {
  const Mat3 none = Mat3::Zero();
  const CellVector at_rest = unstressed(cell), v = moved(cell, u);
  // R^T (x - X) + (R^T - 1) X, the second 0 of straight cells
  const CellVector strained = rotate(r.transpose(), v) + (rotate(r.transpose(), at_rest) - at_rest);
  return {r, Mat3::Identity(), none, none, at_rest + strained, times(model(cell).stiffness, strained), Vec3::Zero()};
}

void CorotationalCells::hold_rotations(const NodeVector& u, const NodeVector* tried, double least) {
  const auto is_below = [&](const Polar& polar) {
    const Vec3 s = Eigen::SelfAdjointEigenSolver<Mat3>(polar.stretch, Eigen::EigenvaluesOnly).eigenvalues();
    return s[0] + s[1] < least;
  };
  std::vector<bool> rotating;
  std::map<std::size_t, Mat3> held;
  for (std::size_t c = 0; c < mesh_.num_cells(); ++c) {
    const Polar polar = polar_decomposition(mean_elastic_gradient(c, u));
    const auto before = held_.find(c);
    const bool keeps =
        before != held_.end() && (tried || energy_in(unrotated_frame(c, u, polar.rotation), c) > cell_energy(c, u));
    if (keeps)
      held.insert(*before);
    else if (is_below(polar) || (tried && is_below(polar_decomposition(mean_elastic_gradient(c, *tried)))))
      held.emplace(c, polar.rotation);
  }
  if (!held.empty()) rotating.assign(mesh_.num_cells(), true);
  for (const auto& [cell, rotation] : held) rotating[cell] = false;
  set_rotating(std::move(rotating));
  held_ = std::move(held);
}

double CorotationalCells::strain_of_rotations(const NodeVector& u) const {
  double largest = 0;
  for (std::size_t c = 0; c < mesh_.num_cells(); ++c) {
    const double angle = rotation_angle(polar_decomposition(mean_gradient(c, u)).rotation);
    largest = std::max(largest, angle * angle * (model(c).bulk / (2 * model(c).shear) + 1.0 / 6));
  }
  return largest;
}

/// Of the mean gradient F = R S: the first Piola-Kirchhoff stress of W(S) is R T, T = dW/dS, and Cauchy's R T S R^T /
/// J. T and S have the same axes. A cell that does not rotate has T by sym F, whose part that turns is left out.
Mat3 CorotationalCells::stress(std::size_t cell, const NodeVector& u) const {
  const Mat3 f = mean_elastic_gradient(cell, u);
  if (is_straight(cell)) {
    const Mat3 kirchhoff = hooke_stress(model(cell), (f + f.transpose()) / 2 - Mat3::Identity()) * f.transpose();
    return cauchy_stress((kirchhoff + kirchhoff.transpose()) / 2, f.determinant());
  }
  const Polar polar = polar_decomposition(f);
  const Mat3 in_frame = hooke_stress(model(cell), polar.stretch - Mat3::Identity()) * polar.stretch;
  return cauchy_stress(polar.rotation * in_frame * polar.rotation.transpose(), f.determinant());
}

void CorotationalCells::add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const {
  if (is_at(u)) {
    mesh_.for_each_batch([&](std::size_t b) {
      alignas(64) std::array<double, 24 * lanes> values;
      RotatedCells<double> space;
      forces_of_rotated(models_of_batch<double>(b), rotated(b, space), values.data());
      for (std::size_t lane = 0; lane < mesh_.batches()[b].count; ++lane) {
        CellVector force;
        for (std::size_t n = 0; n < 24; ++n) force[n] = values[lanes * n + lane];
        mesh_.scatter_add(mesh_.batches()[b].first + lane, force, gradient);
        mesh_.scatter_add(mesh_.batches()[b].first + lane, force.cwiseAbs(), magnitude);
      }
    });
    return;
  }
  mesh_.for_each_cell([&](std::size_t c) {
    if (is_straight(c)) {
      const CellVector linear = times(model(c).stiffness, moved(c, u));
      mesh_.scatter_add(c, linear, gradient);
      mesh_.scatter_add(c, linear.cwiseAbs(), magnitude);
      return;
    }
    const CellVector force = this->force(frame(c, u), model(c).mean_gradient);
    mesh_.scatter_add(c, force, gradient);
    mesh_.scatter_add(c, force.cwiseAbs(), magnitude);
  });
}

CellVector CorotationalCells::force(const CorotationalFrame& frame, const NodeGradients& mean_gradient) {
  CellVector in_frame = frame.f;
  for (int a = 0; a < 8; ++a) in_frame.segment<3>(3 * a) -= frame.h.cross(Vec3(mean_gradient.row(a)));
  return rotate(frame.r, in_frame);
}

CorotationalFrame CorotationalCells::kept_frame(std::size_t cell) const {
  if (saves_memory_) return frame_of_state(cell);
  return unpacked(frames_[mesh_.batch_of(cell)], mesh_.lane_of(cell));
}

void CorotationalCells::keep_state(const NodeVector& u, bool stressed) {
  if (is_at(u) && (is_stressed_ || !stressed)) return;
  is_stressed_ = stressed;
  state_ = u;
  if (!is_at_rest_on_lattice()) moved_ = u - to_rest();
  positive_.clear();
  single_is_current_ = false;
  if (saves_memory_) return;
  frames_.resize(mesh_.batches().size());
  mesh_.for_each_batch([&](std::size_t b) { rotate_batch(b, frames_[b]); });
}

void CorotationalCells::move_to(const NodeVector& u) { keep_state(u, true); }

void CorotationalCells::linearize(const NodeVector& u, double projection) {
  keep_state(u, projection != Hessian::without_stress);
  projection_ = projection;
  if (projection > Hessian::exact && projection <= Hessian::projected)
    project();
  else
    positive_.clear();
}

void CorotationalCells::project() {
  if (!positive_.empty()) return;
  positive_.resize(mesh_.batches().size());
  mesh_.for_each_batch([&](std::size_t b) {
    const Mesh::Batch& batch = mesh_.batches()[b];
    RotatedCells<double> space;
    const RotatedCells<double>& cells = rotated(b, space);
    for (std::size_t lane = 0; lane < batch.count; ++lane) {
      const std::size_t c = batch.first + lane;
      PositivePart part;
      if (rotates(c)) part = positive_part(stress_term(unpacked(cells, lane), model(c).mean_gradient));
      pack(part, positive_[b], lane);
    }
  });
}

CorotationalFrame CorotationalCells::frame_of_state(std::size_t cell) const {
  CorotationalFrame f = frame(cell, state_);
  if (is_stressed_ && rotates(cell)) f.a = stress_matrix(f);
  return f;
}

bool CorotationalCells::rotates_somewhere(std::size_t batch) const {
  const Mesh::Batch& cells = mesh_.batches()[batch];
  for (std::size_t c = cells.first; c < cells.first + cells.count; ++c)
    if (rotates(c)) return true;
  return false;
}

CorotationalCells::RestOfLanes CorotationalCells::rest_of_batch(std::size_t batch) const {
  const Mesh::Batch& of = mesh_.batches()[batch];
  RestOfLanes out;
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    const CellVector of_cell = unstressed(of.first + std::min(lane, of.count - 1));
    for (std::size_t n = 0; n < 24; ++n) out[n][lane] = of_cell[n];
  }
  return out;
}

void CorotationalCells::rotate_batch(std::size_t batch, RotatedCells<double>& cells) const {
  const Mesh::Batch& of = mesh_.batches()[batch];
  unsigned left = (1U << lanes) - 1;
  if (rotates_somewhere(batch) && !is_prestretched())  // cells that are no longer one body have no nodes in common
    left = rotate_cells(models_of_batch<double>(batch), is_stressed_, nodes_of_batch(mesh_, batch),
                        rest_of_batch(batch)[0].data(), is_at_rest_on_lattice() ? state_.data() : moved_.data(), cells);
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    const std::size_t cell = of.first + std::min(lane, of.count - 1);
    if (left >> lane & 1U || !rotates(cell)) pack(frame_of_state(cell), cells, lane);
  }
}

const RotatedCells<double>& CorotationalCells::rotated(std::size_t batch, RotatedCells<double>& space) const {
  if (!saves_memory_) return frames_[batch];
  rotate_batch(batch, space);
  return space;
}

const RotatedCells<float>& CorotationalCells::rotated(std::size_t batch, RotatedCells<float>& /*space*/) const {
  return single_frames_[batch];
}

void CorotationalCells::keep_single_frames() const {
  if (single_is_current_) return;
  static_assert(sizeof(RotatedCells<double>) == 2 * sizeof(RotatedCells<float>));
  constexpr std::size_t numbers = sizeof(RotatedCells<float>) / sizeof(float);
  single_frames_.resize(mesh_.batches().size());
  mesh_.for_each_batch([&](std::size_t b) {
    RotatedCells<double> space;
    const double* from = rotated(b, space).y[0].data();
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
    if (alike) models.alike = model(batch.first).alike();
  } else {
    const SingleModels& single = single_models();
    models.alike = single.stiffness.alike(number);
    if (!models.alike.full) models.packed = &single.stiffness.packed(number);
    for (std::size_t lane = 0; lane < (models.alike.full ? 1 : lanes); ++lane)
      models.mean_gradient[lane] = single.mean_gradient[elements_[cell_of(lane)]].data();
  }
  return models;
}

template <class Vector>
void CorotationalCells::add_product_of(const Vector& x, Vector& y) const {
  using Real = typename Vector::Scalar;
  if (std::is_same_v<Real, float>) {
    single_models();
    keep_single_frames();
  }
  mesh_.for_each_batch([&](std::size_t b) {
    RotatedCells<Real> space;
    fetch(kept_frames<Real>(), b + 1);
    add_rotated_product(models_of_batch<Real>(b), rotated(b, space), projection_ == Hessian::exact,
                        positive_.empty() ? nullptr : &positive_[b], nodes_of_batch(mesh_, b), x.data(), y.data());
  });
}

void CorotationalCells::add_product(const NodeVector& x, NodeVector& y) const { add_product_of(x, y); }
void CorotationalCells::add_product(const FloatNodeVector& x, FloatNodeVector& y) const { add_product_of(x, y); }

std::size_t CorotationalCells::bytes() const {
  return ElasticCells::bytes() + hexmesh::bytes_of(frames_) + hexmesh::bytes_of(single_frames_) +
         hexmesh::bytes_of(positive_) + sizeof(double) * static_cast<std::size_t>(state_.size() + moved_.size());
}

void CorotationalCells::add_diagonal(std::size_t cell, NodeBlocks& blocks) const {
  hexsolver::add_diagonal(rotates(cell) ? kept_frame(cell).r : kept_rotation(cell), model(cell).stiffness, blocks);
}

/// R Q^T b. It is R b where b are V times the gradients that R is found by, since the part of Q from the change of R
/// has no trace by these; condensed cells have others.
Dilatation CorotationalCells::dilatation(std::size_t cell) const {
  if (!rotates(cell)) return rotated_dilatation(cell, kept_rotation(cell));
  CorotationalFrame frame = kept_frame(cell);
  if (!model(cell).condensed) return rotated_dilatation(cell, frame.r);
  Dilatation out = rotated_dilatation(cell, Mat3::Identity());
  add_forces(out.divergence, frame);
  out.divergence = force(frame, model(cell).mean_gradient);
  return out;
}

void CorotationalCells::add_cell_hessian(std::size_t cell, CellMatrix& hessian) const {
  const CellMatrix& k = model(cell).stiffness;
  if (is_straight(cell)) {
    hessian += k;
    return;
  }
  const CorotationalFrame f = kept_frame(cell);
  const StressTerm e = stress_term(f, model(cell).mean_gradient);
  Eigen::Matrix<double, 24, 3> y, ky;  // w x y_a = (Y w)_a
  for (int a = 0; a < 8; ++a) y.block<3, 3>(3 * a, 0) = -cross_matrix(f.y.segment<3>(3 * a));
  for (int column = 0; column < 3; ++column) ky.col(column) = times(k, y.col(column));
  // (1 - Y T)^T K (1 - Y T) = K - B^T - B with B = T^T (Y^T K - Y^T K Y T / 2)
  const Mat3 yky = y.transpose().lazyProduct(ky);
  const Rows t = e.t;
  Rows inner = (0.5 * yky).lazyProduct(e.t) - ky.transpose();
  if (projection_ == Hessian::exact) inner += e.l + (0.5 * e.a).lazyProduct(e.t);
  Rows z;
  if (!positive_.empty()) {
    const PositivePart part = unpacked(positive_[mesh_.batch_of(cell)], mesh_.lane_of(cell));
    z = part.b.transpose().lazyProduct(e.t) + part.c.transpose().lazyProduct(e.l);
  }
  add_rotated_hessian(k.data(), t.data(), inner.data(), positive_.empty() ? nullptr : z.data(), f.r.data(),
                      hessian.data());
}

}  // namespace hexsolver
