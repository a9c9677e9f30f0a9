// SPDX-License-Identifier: Apache-2.0
#include "multigrid/multigrid.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "constraints/support_springs.h"
#include "core/parallel.h"
#include "hexmesh/core/bytes.h"
#include "linear/lanczos.h"
#include "multigrid/cycles.h"

namespace hexsolver {
namespace {

using Eigen::Index;
using hexmesh::bytes_of;

constexpr int chebyshev_degree = 6;
/// The smoother damps eigenvalues of D^-1 A in [largest / smoothing_range, largest].
constexpr double smoothing_range = 80;

}  // namespace

Multigrid::Multigrid(const Hierarchy& hierarchy, const Potential& potential, const HeldDirections& constraints) {
  if (!hierarchy.in_double) cycles_ = std::make_unique<CyclesOf<float>>(hierarchy, potential, constraints);
  if (cycles_ && cycles_->is_positive()) return;
  auto in_double = std::make_unique<CyclesOf<double>>(hierarchy, potential, constraints);
  if (!cycles_ || in_double->is_positive()) cycles_ = std::move(in_double);
}

Multigrid::~Multigrid() = default;
void Multigrid::update() { cycles_->update(); }
bool Multigrid::is_positive() const noexcept { return cycles_->is_positive(); }
void Multigrid::smooth_carefully() { cycles_->smooth_carefully(); }
void Multigrid::apply(const NodeVector& r, NodeVector& z) const { cycles_->apply(r, z); }
std::size_t Multigrid::bytes() const { return cycles_->bytes(); }

template <class Scalar>
Multigrid::CyclesOf<Scalar>::CyclesOf(const Hierarchy& hierarchy, const Potential& potential,
                                      const HeldDirections& constraints)
    : hierarchy_(hierarchy),
      potential_(potential),
      constraints_(constraints),
      is_solved_at_once_(hierarchy.is_solved_at_once()),
      levels_(hierarchy.meshes.size()) {
  if (!is_solved_at_once_) prepare_smoothing();
  update();
}

template <class Scalar>
void Multigrid::CyclesOf<Scalar>::prepare_smoothing() {
  if (needs_braess_sarazin())
    for (std::size_t level = 0; level < levels_.size(); ++level)
      levels_[level].braess_sarazin = std::make_unique<BraessSarazinSmoother<Scalar>>(
          hierarchy_.meshes[level], level == 0 ? &constraints_ : nullptr, part(level));
  const std::vector<ConstraintPoint>& held = constraints_.held();
  for (std::size_t p = 0; p < held.size(); ++p) points_of_cell_[held[p].cell].push_back(p);
  choose_support_weights();
  const Mesh& finest = hierarchy_.meshes[0];
  if (finest.is_graded())
    private_nodes_ = std::make_unique<PrivateNodes>(finest, [&](std::size_t cell) {
      return finest.size_of(cell) == 0 || points_of_cell_.contains(cell);  // the smallest merge as cells alike do
    });
}

template <class Scalar>
void Multigrid::CyclesOf<Scalar>::update() {
  positive_ = true;
  for (std::size_t level = 0; level + 1 < levels_.size() && positive_; ++level) {
    coarsen(level);
    if (!positive_) return;
    if (is_solved_at_once_) continue;
    estimate_eigenvalue(level);
    if (levels_[level].braess_sarazin) weigh_shape(level);
  }
  if (positive_) factor_coarsest();
  if (private_nodes_ && positive_)
    private_nodes_->update(potential_.couplings().empty()
                               ? [this](std::size_t cell) { return potential_.cell_hessian(cell); }
                               : std::function<CellMatrix(std::size_t)>());
}

template <class Scalar>
bool Multigrid::CyclesOf<Scalar>::needs_braess_sarazin() const {
  double largest = 0;
  for (std::size_t c = 0; c < hierarchy_.meshes[0].num_cells(); ++c)
    if (const Dilatation d = potential_.dilatation(c); d.bulk > 0) largest = std::max(largest, d.bulk / d.shear);
  if (part(0)) largest = part(0)->largest(largest);
  return Multigrid::needs_braess_sarazin(largest);
}

template <class Scalar>
void Multigrid::CyclesOf<Scalar>::choose_support_weights() {
  // As stiff as change of shape: stiffer supports would set the pace of the Braess-Sarazin smoother.
  const auto trace_of = [&](std::size_t cell) {
    CellMatrix k = potential_.cell_hessian(cell);
    if (levels_[0].braess_sarazin) k -= potential_.dilatation(cell).hessian();
    return k.trace();
  };
  support_weight_ = support_weights(constraints_, points_of_cell_, hierarchy_.meshes[0].cell_nodes(), trace_of);
}

template <class Scalar>
void Multigrid::CyclesOf<Scalar>::multiply(std::size_t level, const Vector& x, Vector& y) const {
  if (level > 0) {
    levels_[level].of_all_nodes.apply(hierarchy_.meshes[level], x, y, [&](const Vector& from, Vector& to) {
      set_zero(to, from.size());
      levels_[level].matrices.add_product(from, to);
      levels_[level].couplings.add_product(hierarchy_.meshes[level], from, to);
    });
  } else {
    potential_.apply(x, y);
  }
  if (part(level)) part(level)->add_up(y);
  if (level == 0) constraints_.project(y);
}

template <class Scalar>
void Multigrid::CyclesOf<Scalar>::scale_by_diagonal(std::size_t level, const Vector& r, Vector& d) const {
  d.resize(r.size());
  const auto& inverse = levels_[level].inverse_diagonal;
  const auto count = static_cast<std::ptrdiff_t>(inverse.size());
  for_each_node(count,
                [&](std::ptrdiff_t n) { d.template segment<3>(3 * n) = inverse[n] * r.template segment<3>(3 * n); });
  if (level == 0) constraints_.project(d);
}

/// Of D^-1 A; of A without what resists change of volume where the smoother is that of Braess and Sarazin.
template <class Scalar>
void Multigrid::CyclesOf<Scalar>::estimate_eigenvalue(std::size_t level) {
  Level& l = levels_[level];
  Vector& start = l.b;  // free before a cycle
  const std::vector<Index3>& nodes = hierarchy_.meshes[level].nodes();
  start.resize(static_cast<Index>(hierarchy_.meshes[level].num_dofs()));
  for_each_node(static_cast<std::ptrdiff_t>(hierarchy_.meshes[level].num_nodes()), [&](std::ptrdiff_t n) {
    const Index3 index = part(level) ? part(level)->in_whole(nodes[n]) : nodes[n];
    for (int d = 0; d < 3; ++d) start[3 * n + d] = static_cast<Scalar>(noise_at(index, d));
  });
  // As large in stiff material as in soft, as D^-1 A sees it: what starts at nothing is not found in a few steps.
  const auto count = static_cast<std::ptrdiff_t>(l.inverse_diagonal.size());
  for_each_node(
      count, [&](std::ptrdiff_t n) { start.template segment<3>(3 * n) /= std::sqrt(l.inverse_diagonal[n].trace()); });
  if (level == 0) constraints_.project(start);
  const auto multiply_shape = [&](const Vector& x, Vector& y) {
    multiply(level, x, y);
    if (!l.braess_sarazin) return;
    l.braess_sarazin->subtract_product(x, y);
    if (level == 0) constraints_.project(y);
  };
  l.largest_eigenvalue = hexsolver::largest_eigenvalue(
      LanczosSpace<Vector>{start, l.x, l.r, l.t}, multiply_shape,
      [&](const Vector& r, Vector& z) { scale_by_diagonal(level, r, z); },
      [&](const Vector& x, const Vector& y) { return part(level) ? part(level)->dot(x, y) : dot_in_double(x, y); });
}

/// D is so large that changes of shape come out at most 1 / of_shape times too large.
template <class Scalar>
void Multigrid::CyclesOf<Scalar>::weigh_shape(std::size_t level) {
  constexpr double of_shape = 0.6;
  divide_inverse_diagonal(level, of_shape * levels_[level].largest_eigenvalue);
}

template <class Scalar>
void Multigrid::CyclesOf<Scalar>::divide_inverse_diagonal(std::size_t level, double by) {
  Level& l = levels_[level];
  const auto less = static_cast<Scalar>(1 / by);
  for_each_node(l.inverse_diagonal.size(), [&](std::ptrdiff_t n) { l.inverse_diagonal[n] *= less; });
  l.braess_sarazin->prepare(l.inverse_diagonal);
}

template <class Scalar>
void Multigrid::CyclesOf<Scalar>::smooth_carefully() {
  constexpr double more = 1.5;
  for (std::size_t level = 0; level + 1 < levels_.size(); ++level)
    if (levels_[level].braess_sarazin)
      divide_inverse_diagonal(level, more);
    else
      levels_[level].largest_eigenvalue *= more;
}

template <class Scalar>
void Multigrid::CyclesOf<Scalar>::smooth(std::size_t level, const Vector& b, Vector& x, bool from_zero) const {
  const Level& l = levels_[level];
  if (l.braess_sarazin)
    l.braess_sarazin->smooth([this, level](const Vector& u, Vector& f) { multiply(level, u, f); }, b, x, from_zero,
                             {l.r, l.d, l.t});
  else
    smooth_by_chebyshev(level, b, x, from_zero);
}

/// Chebyshev iteration for D^-1 A x = D^-1 b on [smallest, largest], each step one pass over the vectors.
/// Source: Saad, Iterative Methods for Sparse Linear Systems, 2nd ed. (2003), algorithm 12.1.
template <class Scalar>
void Multigrid::CyclesOf<Scalar>::smooth_by_chebyshev(std::size_t level, const Vector& b, Vector& x,
                                                      bool from_zero) const {
  const Level& l = levels_[level];
  const double largest = l.largest_eigenvalue, smallest = largest / smoothing_range;
  const double theta = (largest + smallest) / 2, delta = (largest - smallest) / 2, sigma = theta / delta;
  const auto inverse = [&](Index n) -> const Block& { return l.inverse_diagonal[n]; };
  const Index count = static_cast<Index>(l.inverse_diagonal.size());
  l.r.resize(b.size());
  l.d.resize(b.size());
  if (from_zero)
    set_zero(x, b.size());
  else
    multiply(level, x, l.t);
  for_each_node(count, [&](std::ptrdiff_t n) {
    Point r = b.template segment<3>(3 * n);
    if (!from_zero) r -= l.t.template segment<3>(3 * n);
    l.r.template segment<3>(3 * n) = r;
    l.d.template segment<3>(3 * n) = inverse(n) * r * static_cast<Scalar>(1 / theta);
  });
  double rho = 1 / sigma;
  for (int k = 1; k < chebyshev_degree; ++k) {
    if (level == 0) constraints_.project(l.d);
    multiply(level, l.d, l.t);
    const double next = 1 / (2 * sigma - rho);
    const auto keep = static_cast<Scalar>(next * rho), add = static_cast<Scalar>(2 * next / delta);
    for_each_node(count, [&](std::ptrdiff_t n) {
      const Point d = l.d.template segment<3>(3 * n),
                  r = l.r.template segment<3>(3 * n) - l.t.template segment<3>(3 * n);
      x.template segment<3>(3 * n) += d;
      l.r.template segment<3>(3 * n) = r;
      l.d.template segment<3>(3 * n) = keep * d + add * (inverse(n) * r);
    });
    rho = next;
  }
  if (level == 0) constraints_.project(l.d);
  parallel_for(x.size(), [&](Index n) { x[n] += l.d[n]; });
}

/// The residual r of a level to b of the next.
template <class Scalar>
void Multigrid::CyclesOf<Scalar>::restrict_to_coarser(std::size_t level) const {
  Vector &r = levels_[level].r, &b = levels_[level + 1].b;
  if (part(level)) part(level)->keep_own(r);
  hierarchy_.prolongations[level].restrict_to(r, b);
  if (part(level + 1))
    part(level + 1)->add_up(b);
  else if (part(level))
    part(level)->sum(std::span<Scalar>(b.data(), static_cast<std::size_t>(b.size())));
}

template <class Scalar>
void Multigrid::CyclesOf<Scalar>::cycle(std::size_t level, const Vector& b, Vector& x) const {
  if (level + 1 == levels_.size()) {
    coarsest_.solve(b, x);
    return;
  }
  const Level& l = levels_[level];
  const Level& coarse = levels_[level + 1];
  if (is_solved_at_once_) {
    l.r = b;
    restrict_to_coarser(level);
    cycle(level + 1, coarse.b, coarse.x);
    hierarchy_.prolongations[level].prolongate(coarse.x, x);
    return;
  }
  smooth(level, b, x, true);
  multiply(level, x, l.t);
  l.r.resize(b.size());
  parallel_for(b.size(), [&](Index n) { l.r[n] = b[n] - l.t[n]; });
  restrict_to_coarser(level);
  cycle(level + 1, coarse.b, coarse.x);
  hierarchy_.prolongations[level].prolongate(coarse.x, l.t);
  if (level == 0) constraints_.project(l.t);
  parallel_for(x.size(), [&](Index n) { x[n] += l.t[n]; });
  smooth(level, b, x, false);
}

template <class Scalar>
std::size_t Multigrid::CyclesOf<Scalar>::bytes() const {
  std::size_t sum = private_nodes_ ? private_nodes_->bytes() : 0;
  for (const Level& l : levels_)
    sum += l.matrices.bytes() + l.couplings.bytes() + bytes_of(l.inverse_diagonal) +
           (l.braess_sarazin ? l.braess_sarazin->bytes() : 0) +
           sizeof(Scalar) * static_cast<std::size_t>(l.b.size() + l.x.size() + l.r.size() + l.d.size() + l.t.size());
  return sum;
}

template <class Scalar>
void Multigrid::CyclesOf<Scalar>::apply(const NodeVector& r, NodeVector& z) const {
  const bool has_private_nodes = private_nodes_ && private_nodes_->any();
  if (has_private_nodes) {
    residual_ = r;
    private_nodes_->solve_first(residual_);
  }
  const NodeVector& left = has_private_nodes ? residual_ : r;
  // In units of |r|: single precision has room for digits, not for scales.
  double scale = left.lpNorm<Eigen::Infinity>();
  if (part(0)) scale = part(0)->largest(scale);
  z.resize(r.size());
  if (scale > 0) {
    const Level& finest = levels_[0];
    finest.b.resize(r.size());
    parallel_for(r.size(), [&](Index n) { finest.b[n] = static_cast<Scalar>(left[n] / scale); });
    cycle(0, finest.b, finest.x);
    parallel_for(r.size(), [&](Index n) { z[n] = scale * static_cast<double>(finest.x[n]); });
    constraints_.project(z);
  } else {
    z.setZero();
  }
  if (has_private_nodes) private_nodes_->solve_last(r, z);
}

}  // namespace hexsolver
