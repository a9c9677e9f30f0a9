// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/lattice/quadrature.h"
#include "hexsolver/scene/law.h"
#include "kernels/cell_matrices.h"
#include "terms/elastic.h"

namespace hexsolver {

/// What isotropic laws are functions of, from H = grad u; small where H is, without cancellation.
struct Invariants {
  double trace = 0;     ///< tr E, E = (H + H^T + H^T H) / 2
  double squared = 0;   ///< E : E
  double dilation = 0;  ///< J - 1
};
Invariants invariants(const Mat3& h);

/// An energy density and its derivatives by I1 = tr C, I2 = C : C and J, C = F^T F.
struct EnergyDensity {
  double value = 0, d1 = 0, d2 = 0, dj = 0, d11 = 0, d1j = 0, djj = 0;
};

/// Laws of large strain, W = shear part + bulk part:
///   Green-Lagrange        mu (E:E - tr(E)^2 / 3) + kappa/2 tr(E)^2, St. Venant and Kirchhoff's
///   neo-Hookean           mu/2 (J^(-2/3) I1 - 3) + kappa/2 (J - 1)^2
///   stable neo-Hookean    mu (2/3 (I1 - 3 - log((I1 + 1) / 4)) + (J - 1)^2 / 12 - (J - 1)) + kappa/2 (J - 1)^2
/// The last is that of Smith, de Goes, Kim, ACM Trans. Graph. 37 (2018) 12, written by mu and kappa of small strain.
EnergyDensity energy_density(Elasticity law, const Invariants& at, double shear, double bulk);

/// First Piola-Kirchhoff stress, dW/dF.
Mat3 first_piola(const EnergyDensity& w, const Mat3& f);

/// dP/dF in the frames of F = U diag(s) V^T: with X' = U^T X V,
/// dP'_ii = sum_j stretch_ij dF'_jj and, for k the axis besides i and j, dP'_ij = same_k dF'_ij + other_k dF'_ji.
/// Source: Stomakhin et al., SCA 2012, for the structure; no quotient is left of it, so equal stretches are no case.
struct Tangent {
  Mat3 u, v, stretch;
  Vec3 same, other;
};
Tangent tangent(const EnergyDensity& w, const Mat3& f);

/// The given part of its negative eigenvalues taken away; with all of them it is the nearest semi-definite one.
Tangent projected(Tangent t, double projection = 1);

/// Cells of a law of large strain, integrated at points inside the material.
///
/// With the mean dilatation the bulk part of a cell is K/2 (mean J - 1)^2, K = int kappa dV. The first two laws have no
/// meaning where a point is inside out: their energy is infinite there.
class HyperelasticCells final : public ElasticCells {
public:
  /// @param points  of each element
  /// @pre Volumetric::full for Green-Lagrange
  HyperelasticCells(const Mesh& mesh, std::vector<std::int32_t> elements, std::vector<ElementModel> models,
                    std::vector<CellPoints> points, Elasticity law, Volumetric volumetric);
  ~HyperelasticCells() override;

  double cell_energy(std::size_t cell, const NodeVector& u) const override;
  Mat3 stress(std::size_t cell, const NodeVector& u) const override;
  void add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const override;
  bool is_linear() const override { return false; }
  void linearize(const NodeVector& u, double projection) override;
  void add_product(const NodeVector& x, NodeVector& y) const override;  ///< in single precision, as its Hessians are
  void add_product(const FloatNodeVector& x, FloatNodeVector& y) const override;
  void add_cell_hessian(std::size_t cell, CellMatrix& h) const override;
  std::int32_t shared_hessian(std::size_t /*cell*/) const override { return own_hessian; }
  std::size_t bytes() const override;
  std::string limit_reached(const NodeVector& u, bool nearly) const override;

private:
  struct State;
  /// Of points whose cell's corners are displaced by `moved` from rest.
  State state(const CellPoints& points, const CellVector& moved) const;
  State state(std::size_t cell, const NodeVector& u) const;
  CellVector force(const State& s) const;
  std::optional<CellVector> force_on_lattice(std::size_t cell, const CellVector& to_unstressed) const override;
  Reshaping reshaping() const override { return Reshaping::points; }
  EnergyDensity density(const CellPoint& p, const Invariants& at, double pressure) const;

  Elasticity law_;
  Volumetric volumetric_;
  std::unique_ptr<CellMatrices<float>> hessians_;  ///< of the last linearize()
  mutable FloatNodeVector single_x_, single_y_;    ///< space for a product
};

}  // namespace hexsolver
