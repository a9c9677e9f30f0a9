// SPDX-License-Identifier: Apache-2.0
#include "multigrid/braess_sarazin.h"

#include <numbers>

#include "constraints/cluster.h"
#include "linear/lanczos.h"

namespace hexsolver {

using Eigen::Index;
using hexmesh::bytes_of;

namespace {

/// Numbers of the cells of a batch.
template <class Real>
struct alignas(Mesh::batch_size * sizeof(Real)) Lanes {
  std::array<Real, Mesh::batch_size> of{};
};

}  // namespace

template <class Real>
BraessSarazinSmoother<Real>::BraessSarazinSmoother(const Mesh& mesh, const HeldDirections* constraints,
                                                   const Subdomain* part)
    : mesh_(mesh),
      constraints_(constraints),
      part_(part),
      rows_(mesh),
      schur_complement_(mesh),
      is_held_(mesh.num_nodes()) {
  const auto num_cells = static_cast<Index>(mesh.num_cells());
  root_.resize(num_cells);
  volume_.resize(num_cells);
  for (Vector& v : of_cells_) v.resize(num_cells);
  for (Vector* v : {&gained_, &pressures_, &before_}) v->setZero(schur_complement_.num_places());
  forces_.resize(mesh.num_dofs());
  steps_.reserve(most_steps);
  if (constraints_ || part_) find_held_corners();
}

template <class Real>
void BraessSarazinSmoother<Real>::find_held_corners() {
  nodes_.resize(forces_.size());
  if (constraints_)
    for (const ConstraintPoint& p : constraints_->held())
      for_each_weight(mesh_, p, [&](std::int32_t n, double) { is_held_[static_cast<std::size_t>(n)] = true; });
  if (part_)
    for (const std::int32_t n : part_->shared_nodes()) is_held_[static_cast<std::size_t>(n)] = true;
  for (std::size_t n = 0; n < is_held_.size(); ++n)
    if (is_held_[n]) held_nodes_.push_back(static_cast<std::int32_t>(n));
  for (std::size_t c = 0; c < mesh_.num_cells(); ++c)
    for (std::size_t a = 0; a < 8; ++a)
      mesh_.for_each_free(c, a, [&](std::int32_t n, double weight) {
        if (is_held_[static_cast<std::size_t>(n)])
          held_corners_.push_back({c, a, static_cast<Real>(weight), n, Point::Zero()});
      });
}

template <class Real>
Dilatation BraessSarazinSmoother<Real>::get(std::size_t cell) const {
  const auto c = static_cast<Index>(cell);
  const auto volume = static_cast<double>(volume_[c]), root = static_cast<double>(root_[c]);
  Dilatation out{.bulk = root * root * volume, .volume = volume};
  if (root > 0) out.divergence = rows_.get(cell).template cast<double>().reshaped() / root;
  return out;
}

/// What batches share was found at their first cell.
template <class Real>
void BraessSarazinSmoother<Real>::copy_to_shared() {
  const SharedBatches& batches = rows_.batches();
  for (std::size_t b = 0; b < mesh_.batches().size(); ++b) {
    if (!batches.is_shared(b)) continue;
    const std::size_t first = batches.shared()[batches.shared_place(b)].first_cell;
    const Mesh::Batch& batch = mesh_.batches()[b];
    for (std::size_t c = batch.first; c < batch.end(); ++c) {
      root_[c] = root_[first];
      volume_[c] = volume_[first];
    }
  }
}

/// put(cell, (B u) of the cell)
template <class Real>
template <class Put>
void BraessSarazinSmoother<Real>::gain(const Vector& of_free, const Put& put) const {
  if (mesh_.num_hanging() > 0) mesh_.spread(of_free, all_nodes_);
  const Vector& u = mesh_.num_hanging() > 0 ? all_nodes_ : of_free;
  const bool in_parallel = mesh_.num_cells() >= cells_worth_threads;
#pragma omp parallel for schedule(static) if (in_parallel)
  for (std::size_t b = 0; b < mesh_.batches().size(); ++b) {
    const Mesh::Batch& batch = mesh_.batches()[b];
    Lanes<Real> sums;
    dot_with_cells(rows_.of_batch(b), nodes_of_batch(mesh_, b), u.data(), sums.of.data());
    for (std::size_t lane = 0; lane < batch.count; ++lane) put(batch.first + lane, sums.of[lane]);
  }
}

/// f += B^T p
/// @param of_cell  cell -> p, of the cells of this process
template <class Real>
template <class Pressure>
void BraessSarazinSmoother<Real>::add_forces(const Pressure& of_cell, Vector& f) const {
  if (part_) part_->keep_own(f);
  const bool some_hang = mesh_.num_hanging() > 0;
  if (some_hang) all_nodes_.setZero(3 * static_cast<Index>(mesh_.num_all_nodes()));
  Vector& to = some_hang ? all_nodes_ : f;
  mesh_.for_each_batch([&](std::size_t b) {
    const Mesh::Batch& batch = mesh_.batches()[b];
    Lanes<Real> p;
    for (std::size_t lane = 0; lane < batch.count; ++lane) p.of[lane] = of_cell(batch.first + lane);
    add_multiples_of_cells(rows_.of_batch(b), p.of.data(), nodes_of_batch(mesh_, b), to.data());
  });
  if (some_hang) {
    mesh_.pass_on(all_nodes_);
    f += all_nodes_.head(f.size());
  }
  if (part_) part_->add_up(f);
}

template <class Real>
void BraessSarazinSmoother<Real>::subtract_product(const Vector& x, Vector& y) const {
  Vector& gained = of_cells_[0];
  gain(x, [&](std::size_t c, Real of_cell) { gained[c] = of_cell; });
  add_forces([&](std::size_t c) { return -gained[c]; }, y);
}

/// p, before <- p + keep (p - before) - add (p + of_gained gained + B P D^-1 P B^T p), p
template <class Real>
void BraessSarazinSmoother<Real>::step(const PressureStep<Real>& step) const {
  schur_complement_.step(step, gained_, pressures_, before_);
  if (!held_nodes_.empty() || part_) step_held(step.add);
  pressures_.swap(before_);
}

/// What of a step comes by way of held nodes.
template <class Real>
void BraessSarazinSmoother<Real>::step_held(Real add) const {
  const auto of_node = [&](std::int32_t n) { return nodes_.template segment<3>(3 * Index{n}); };
  for (const std::int32_t n : held_nodes_) of_node(n).setZero();
  for (const HeldCorner& h : held_corners_) of_node(h.node) += pressure(h.cell) * h.of_row;
  if (part_) part_->add_up(nodes_);
  if (constraints_) constraints_->project(nodes_);
  for (const std::int32_t n : held_nodes_) {
    const Point v = of_node(n);
    of_node(n) = (*inverse_)[n] * v;
  }
  if (constraints_) constraints_->project(nodes_);
  for (const HeldCorner& h : held_corners_)
    before_[schur_complement_.place(h.cell)] -= add * h.of_row.dot(of_node(h.node));
}

template <class Real>
void BraessSarazinSmoother<Real>::prepare(const std::vector<Block>& inverse) {
  inverse_ = &inverse;
  schur_complement_.set(rows_, inverse, is_held_);
  for (HeldCorner& h : held_corners_) h.of_row = h.weight * rows_.get(h.cell).col(static_cast<Index>(h.corner));

  Vector& start = of_cells_[0];
  for (std::size_t c = 0; c < mesh_.num_cells(); ++c) {
    const Index3& index = mesh_.cells()[c];
    start[c] = static_cast<Real>(noise_at(part_ ? part_->in_whole(index) : index, 0));
  }
  const auto multiply = [&](const Vector& x, Vector& y) {  // y = B P D^-1 P B^T x
    parallel_for(x.size(), [&](Index c) { pressure(c) = x[c]; });
    step({0, 0, 1});
    parallel_for(x.size(), [&](Index c) { y[c] = -pressure(c); });
  };
  choose_steps(largest_eigenvalue(
      LanczosSpace<Vector>{start, of_cells_[1], of_cells_[2], of_cells_[3]}, multiply,
      [](const Vector& r, Vector& z) { z = r; },
      [this](const Vector& x, const Vector& y) {
        const double own = dot_in_double(x, y);
        return part_ ? part_->sum(own) : own;
      }));
}

/// @param largest  eigenvalue of B P D^-1 P B^T
template <class Real>
void BraessSarazinSmoother<Real>::choose_steps(double largest) {
  // Of 1 + S in [1, end]. The polynomial's least root is at 1, where changes of shape are.
  const double end = 1 + largest;
  double middle = 1, half = 0;
  int count = 1;
  for (; count < most_steps; ++count) {
    const double gap = 1 - std::cos(std::numbers::pi / (2 * count));
    const double begin = (1 - end * gap / 2) / (1 - gap / 2);
    if (begin <= 0) continue;
    middle = (end + begin) / 2;
    half = (end - begin) / 2;
    if (half < 1e-6 * middle || 1 / std::cosh(count * std::acosh(middle / half)) <= accuracy) break;
  }
  // Chebyshev iteration for (1 + D^-1 B^T B) z = D^-1 r. Its vectors are a D^-1 r + D^-1 B^T p each, p a pressure for
  // each cell. Source: Saad, Iterative Methods for Sparse Linear Systems, 2nd ed. (2003), algorithm 12.1.
  steps_.clear();
  double a = 1 / middle, a_before = 0, rho = half / middle;
  for (int n = 1; n < count; ++n) {
    const double next_rho = 1 / (2 * middle / half - rho), keep = next_rho * rho, add = 2 * next_rho / half;
    steps_.push_back({static_cast<Real>(a), static_cast<Real>(keep), static_cast<Real>(add)});
    const double a_next = a + keep * (a - a_before) + add * (1 - a);
    a_before = a;
    a = a_next;
    rho = next_rho;
  }
  of_residual_ = static_cast<Real>(a);
}

/// The pressures in M^-1 r.
/// @param z  D^-1 r; P D^-1 r thereafter
template <class Real>
void BraessSarazinSmoother<Real>::find_pressures(Vector& z) const {
  if (steps_.empty()) return;
  if (constraints_) constraints_->project(z);
  const Real first = -steps_[0].add * steps_[0].of_gained;
  gain(z, [&](std::size_t c, Real of_cell) {
    const auto at = static_cast<Index>(schur_complement_.place(c));
    gained_[at] = of_cell;
    pressures_[at] = first * of_cell;
    before_[at] = 0;
  });
  for (std::size_t n = 1; n < steps_.size(); ++n) step(steps_[n]);
}

/// f += B^T p, in the range of P
template <class Real>
void BraessSarazinSmoother<Real>::add_pressures(Vector& f) const {
  if (steps_.empty()) return;
  add_forces([&](std::size_t c) { return pressure(c); }, f);
  if (constraints_) constraints_->project(f);
}

template <class Real>
void BraessSarazinSmoother<Real>::smooth(const Product& multiply, const Vector& b, Vector& x, bool from_zero,
                                         const Space& space, int degree) const {
  // Chebyshev iteration for M^-1 K x = M^-1 b about 1, where changes of volume are.
  constexpr double half = 0.6, sigma = 1 / half;
  Vector &r = space.r, &d = space.d, &t = space.t;
  for (Vector* v : {&x, &r, &d, &t}) v->resize(b.size());
  const auto count = static_cast<std::ptrdiff_t>(inverse_->size());
  const auto inverse = [&](Index n) -> const Block& { return (*inverse_)[n]; };
  double rho = half;
  for (int k = 0; k < degree; ++k) {
    const bool is_first = k == 0;
    if (!is_first || !from_zero) multiply(is_first ? x : d, t);
    for_each_node(count, [&](std::ptrdiff_t n) {
      Point of_r = (is_first ? b : r).template segment<3>(3 * n);
      if (!is_first || !from_zero) of_r -= t.template segment<3>(3 * n);
      if (!is_first)
        x.template segment<3>(3 * n) += d.template segment<3>(3 * n);
      else if (from_zero)
        x.template segment<3>(3 * n).setZero();
      r.template segment<3>(3 * n) = of_r;
      t.template segment<3>(3 * n) = inverse(n) * of_r;
      forces_.template segment<3>(3 * n) = of_residual_ * of_r;
    });
    find_pressures(t);
    add_pressures(forces_);
    const double next = 1 / (2 * sigma - rho);
    const auto keep = static_cast<Real>(is_first ? 0 : next * rho),
               add = static_cast<Real>(is_first ? 1 : 2 * next / half);
    for_each_node(count, [&](std::ptrdiff_t n) {
      const Point z = inverse(n) * forces_.template segment<3>(3 * n) * add;
      if (is_first)
        d.template segment<3>(3 * n) = z;
      else
        d.template segment<3>(3 * n) = keep * d.template segment<3>(3 * n) + z;
    });
    if (constraints_) constraints_->project(d);
    if (!is_first) rho = next;
  }
  parallel_for(x.size(), [&](Index n) { x[n] += d[n]; });
}

template <class Real>
std::size_t BraessSarazinSmoother<Real>::bytes() const {
  std::size_t numbers = 0;
  for (const Vector* v :
       std::initializer_list<const Vector*>{&root_, &volume_, &gained_, &pressures_, &before_, &forces_, &nodes_})
    numbers += static_cast<std::size_t>(v->size());
  for (const Vector& v : of_cells_) numbers += static_cast<std::size_t>(v.size());
  return rows_.bytes() + schur_complement_.bytes() + bytes_of(steps_) + is_held_.capacity() / 8 +
         bytes_of(held_nodes_) + bytes_of(held_corners_) + sizeof(Real) * numbers;
}

template class BraessSarazinSmoother<float>;
template class BraessSarazinSmoother<double>;

}  // namespace hexsolver
