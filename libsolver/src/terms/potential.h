// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "terms/term.h"

namespace hexsolver {

/// The forces of some terms on the free nodes of their mesh at u, -dW/du [N].
template <class Terms>
NodeVector forces_of(const Terms& terms, const Mesh& mesh, const NodeVector& u) {
  NodeVector all;
  mesh.spread(u, all);
  NodeVector gradient = NodeVector::Zero(all.size()), magnitude = gradient;
  for (const auto& term : terms) term->add_gradient(all, gradient, magnitude);
  mesh.collect(gradient);
  return -gradient;
}

/// The potential energy of one level: the sum of its terms.
///
/// Fields are given at the free nodes of the mesh; terms get them at all nodes, and what they say of hanging ones goes
/// to those these hang on.
class Potential {
public:
  explicit Potential(const Mesh& mesh) : mesh_(mesh) {}  ///< `mesh` must outlive this

  void add(std::unique_ptr<Term> term) { terms_.push_back({std::move(term)}); }

  bool is_linear() const;
  bool adds_displacements_alone() const;  ///< see Term
  bool is_conservative() const;

  /// Energy, gradient and linearization at u are asked for next; as Term::move_to.
  void move_to(const NodeVector& u);

  double energy(const NodeVector& u) const;                                ///< [N mm]
  double longest_step(const NodeVector& u, const NodeVector& step) const;  ///< least of all terms; as Term's

  /// Gradient and the sum of the absolute values it is made of [N].
  void gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const;

  /// The same without one of the terms.
  void gradient_without(const Term& left_out, const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const;

  double gradient_jump(const NodeVector& u) const;  ///< as Term::gradient_jump [N]
  double rounding() const;                          ///< size of the rounding errors in a gradient [N]
  double energy_rounding() const;                   ///< of those in an energy [N mm]

  /// Prepare apply() and cell_hessian() at u.
  void linearize(const NodeVector& u, double projection);

  void apply(const NodeVector& x, NodeVector& y) const;            ///< y = H x
  void apply(const FloatNodeVector& x, FloatNodeVector& y) const;  ///< likewise, in single precision
  CellMatrix cell_hessian(std::size_t cell) const;                 ///< shape (24, 24), symmetric
  Dilatation dilatation(std::size_t cell) const;                   ///< of the one term that has one
  void add_diagonal(std::size_t cell, NodeBlocks& blocks) const;   ///< as Term::add_diagonal

  Couplings couplings() const;  ///< of all terms, as Term::couplings

  /// Cells of one number share their Hessian; Term::own_hessian where a cell has its own.
  std::int32_t shared_hessian(std::size_t cell) const;

  const Mesh& mesh() const noexcept { return mesh_; }

  /// A field at all nodes, until the next is asked for.
  const NodeVector& at_all(const NodeVector& u) const;

  /// The forces of each term but the cells' on the nodes, -dW/du [N]: take(name, forces).
  void for_each_load(const NodeVector& u,
                     const std::function<void(const std::string& name, const NodeVector& forces)>& take) const;

  struct Cost {
    EffectKind effect = EffectKind::elasticity;
    std::string name;
    double seconds = 0;            ///< spent in the term since it was made
    double linearize_seconds = 0;  ///< of these in move_to() and linearize()
    std::size_t bytes = 0;         ///< of memory, now
  };
  std::vector<Cost> costs() const;

private:
  struct Timed {
    std::unique_ptr<Term> term;
    mutable double seconds = 0;
    double linearize_seconds = 0;
  };
  template <class F>
  void for_each_term(F&& f) const;
  void sum_gradients(const Term* left_out, const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const;
  template <class Vector>
  void apply_terms(const Vector& x, Vector& y) const;

  const Mesh& mesh_;
  std::vector<Timed> terms_;
  mutable NodeVector state_;  ///< space for fields at all nodes
  mutable OfAllNodes<NodeVector> product_;
  mutable OfAllNodes<FloatNodeVector> single_product_;
};

}  // namespace hexsolver
