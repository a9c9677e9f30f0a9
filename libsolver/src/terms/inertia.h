// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "mesh/mesh_cells.h"
#include "terms/term.h"

namespace hexsolver {

/// Row sums of the mass matrix of each element of the cells [tonne].
/// @throws Error{input} for material without mass
std::vector<NodeWeights> lumped_masses(const MeshCells& cells);

/// What a step of implicit Euler from u_0 with velocity v_0 (see BackwardDifference for others) adds to the energy: the
/// lumped masses M, and damping in proportion a to them,
///
///     1 / (2 h^2) |u - u_0 - h v_0|_M^2 + a / (2 h) |u - u_0|_M^2,
///
/// whose gradient is M (v - v_0) / h + a M v with v = (u - u_0) / h. Source: Martin, Thomaszewski, Grinspun, Gross,
/// "Example-based elastic materials" (2011), section 4, for the step as a minimum; the paper's implicit Euler.
class Inertia final : public Term {
public:
  /// @param elements  of each cell
  /// @param masses    of each element, as lumped_masses()
  /// @param damping   a [1/s]
  Inertia(const Mesh& mesh, std::vector<std::int32_t> elements, std::vector<NodeWeights> masses, double damping);

  /// Begin a step of h seconds.
  void set_step(const NodeVector& u, const NodeVector& velocity, double h);

  /// The inertial predictor: displacements of the nodes from u over the step if nothing but a field of acceleration
  /// [mm/s^2] acted.
  void inertial_predictor(const Vec3& acceleration, const NodeVector& u, NodeVector& d) const;

  EffectKind effect() const override { return EffectKind::inertia; }
  double energy(const NodeVector& u) const override;
  void add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const override;
  double rounding() const override { return rounding_; }
  void add_product(const NodeVector& x, NodeVector& y) const override;
  void add_product(const FloatNodeVector& x, FloatNodeVector& y) const override;
  void add_cell_hessian(std::size_t cell, CellMatrix& h) const override;
  void add_diagonal(std::size_t cell, NodeBlocks& blocks) const override;
  std::int32_t shared_hessian(std::size_t cell) const override { return elements_[cell]; }
  std::size_t bytes() const override;

  const std::vector<double>& node_masses() const noexcept { return node_masses_; }  ///< [tonne]
  double kinetic_energy(const NodeVector& velocity) const;                          ///< 1/2 v^T M v [N mm]
  Vec3 momentum(const NodeVector& velocity) const;                                  ///< sum_n m_n v_n [N s]

private:
  template <class Vector>
  void add_product_of(const Vector& x, Vector& y) const;

  std::vector<std::int32_t> elements_;
  std::vector<NodeWeights> masses_;
  std::vector<double> node_masses_;  ///< of the free nodes, with their parts of hanging ones
  double damping_;
  double stiffness_ = 0;  ///< 1 / h^2 + a / h, of a unit of mass [1/s^2]
  NodeVector aim_;        ///< where the sum of the two squares is least
  double rounding_ = 0;
};

}  // namespace hexsolver
