// SPDX-License-Identifier: Apache-2.0
#include "terms/potential.h"

#include <algorithm>
#include <array>

#include "core/parallel.h"
#include "core/stopwatch.h"

namespace hexsolver {

template <class F>
void Potential::for_each_term(F&& f) const {
  for (const Timed& t : terms_) {
    const Stopwatch watch;
    f(*t.term);
    t.seconds += watch.seconds();
  }
}

bool Potential::is_linear() const {
  return std::all_of(terms_.begin(), terms_.end(), [](const Timed& t) { return t.term->is_linear(); });
}

bool Potential::adds_displacements_alone() const {
  return std::all_of(terms_.begin(), terms_.end(), [](const Timed& t) { return t.term->adds_displacements_alone(); });
}

bool Potential::is_conservative() const {
  return std::all_of(terms_.begin(), terms_.end(), [](const Timed& t) { return t.term->is_conservative(); });
}

const NodeVector& Potential::at_all(const NodeVector& u) const {
  if (mesh_.num_hanging() == 0) return u;
  mesh_.spread(u, state_);
  return state_;
}

void Potential::move_to(const NodeVector& u) {
  const NodeVector& at = at_all(u);
  for (Timed& t : terms_) {
    const Stopwatch watch;
    t.term->move_to(at);
    t.seconds += watch.seconds();
    t.linearize_seconds += watch.seconds();
  }
}

double Potential::energy(const NodeVector& u) const {
  const NodeVector& at = at_all(u);
  double sum = 0;
  for_each_term([&](const Term& t) { sum += t.energy(at); });
  return sum;
}

void Potential::gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const {
  sum_gradients(nullptr, u, gradient, magnitude);
}

void Potential::gradient_without(const Term& left_out, const NodeVector& u, NodeVector& gradient,
                                 NodeVector& magnitude) const {
  sum_gradients(&left_out, u, gradient, magnitude);
}

void Potential::sum_gradients(const Term* left_out, const NodeVector& u, NodeVector& gradient,
                              NodeVector& magnitude) const {
  const NodeVector& at = at_all(u);
  gradient.setZero(at.size());
  magnitude.setZero(at.size());
  for_each_term([&](const Term& t) {
    if (&t != left_out) t.add_gradient(at, gradient, magnitude);
  });
  mesh_.collect(gradient);
  mesh_.collect(magnitude);
}

void Potential::for_each_load(const NodeVector& u,
                              const std::function<void(const std::string&, const NodeVector&)>& take) const {
  for (const Timed& t : terms_)
    if (t.term->effect() != EffectKind::elasticity) take(t.term->name(), forces_of(std::array{t.term.get()}, mesh_, u));
}

double Potential::gradient_jump(const NodeVector& u) const {
  double sum = 0;
  for (const Timed& t : terms_) sum += t.term->gradient_jump(u);
  return sum;
}

double Potential::rounding() const {
  double sum = 0;
  for (const Timed& t : terms_) sum += t.term->rounding();
  return sum;
}

double Potential::energy_rounding() const {
  double sum = 0;
  for (const Timed& t : terms_) sum += t.term->energy_rounding();
  return sum;
}

void Potential::linearize(const NodeVector& u, double projection) {
  const NodeVector& at = at_all(u);
  for (Timed& t : terms_) {
    const Stopwatch watch;
    t.term->linearize(at, projection);
    t.seconds += watch.seconds();
    t.linearize_seconds += watch.seconds();
  }
}

template <class Vector>
void Potential::apply_terms(const Vector& x, Vector& y) const {
  set_zero(y, x.size());
  for_each_term([&](const Term& t) { t.add_product(x, y); });
}

void Potential::apply(const NodeVector& x, NodeVector& y) const {
  product_.apply(mesh_, x, y, [this](const NodeVector& from, NodeVector& to) { apply_terms(from, to); });
}

void Potential::apply(const FloatNodeVector& x, FloatNodeVector& y) const {
  single_product_.apply(mesh_, x, y,
                        [this](const FloatNodeVector& from, FloatNodeVector& to) { apply_terms(from, to); });
}

CellMatrix Potential::cell_hessian(std::size_t cell) const {
  CellMatrix h = CellMatrix::Zero();
  for (const Timed& t : terms_) t.term->add_cell_hessian(cell, h);
  return h;
}

Dilatation Potential::dilatation(std::size_t cell) const {
  for (const Timed& t : terms_)
    if (Dilatation d = t.term->dilatation(cell); d.bulk > 0) return d;
  return {};
}

void Potential::add_diagonal(std::size_t cell, NodeBlocks& blocks) const {
  for (const Timed& t : terms_) t.term->add_diagonal(cell, blocks);
}

double Potential::longest_step(const NodeVector& u, const NodeVector& step) const {
  double part = 1;
  for (const Timed& t : terms_) part = std::min(part, t.term->longest_step(u, step));
  return part;
}

Couplings Potential::couplings() const {
  Couplings out;
  for (const Timed& t : terms_)
    if (const Couplings* of_term = t.term->couplings()) out.add(*of_term);
  return out;
}

std::int32_t Potential::shared_hessian(std::size_t cell) const {
  std::int32_t number = Term::no_hessian;
  for (const Timed& t : terms_) {
    const std::int32_t n = t.term->shared_hessian(cell);
    if (n == Term::no_hessian) continue;
    number = number == Term::no_hessian || number == n ? n : Term::own_hessian;
  }
  return number;
}

std::vector<Potential::Cost> Potential::costs() const {
  std::vector<Cost> out;
  for (const Timed& t : terms_)
    out.push_back({t.term->effect(), t.term->name(), t.seconds, t.linearize_seconds, t.term->bytes()});
  return out;
}

}  // namespace hexsolver
