// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hexsolver/mesh.h"
#include "hexsolver/rotation.h"

namespace hexsolver {

enum class Strain { cauchy, corotational };
enum class Volumetric { mean, full };

/// The elastic energy of all cells of one level.
///
///   Cauchy:         W(u) = 1/2 u^T K u                                             (1)
///   co-rotational:  W(x) = 1/2 (R^T x - X)^T K (R^T x - X), R = polar(F),          (2)
///                   F = the averages of the four edges per direction = grad x at the cell's centre
///
/// The gradient and the Hessian of (2) are exact, with R a function of x, so the forces of a cell have no net force and
/// no net torque. Derivation: THEORY.md, "Co-rotational cells". Source of (2) with R held: Nesme, Faure, Payan 2010.
class Elastic {
public:
  /// @param elements  number of the stiffness of each cell
  /// @param stiffness  K of each element [N/mm]
  Elastic(const Mesh& mesh, std::vector<std::int32_t> elements, std::vector<CellMatrix> stiffness, Strain strain);

  double energy(const NodeVector& u) const;                                   ///< [N mm]
  std::vector<double> cell_energies(const NodeVector& u) const;               ///< [N mm]

  /// Gradient = internal forces [N]; magnitude = sum over cells of their absolute values, the scale of a residual.
  void gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const;

  /// Prepare apply() and cell_hessian() at u.
  /// @param stress_weight  1: the exact Hessian; 0: without the terms that grow with the stress, which leaves a
  ///                       positive semi-definite matrix (Gauss-Newton)
  void linearize(const NodeVector& u, double stress_weight);

  /// y = H x
  void apply(const NodeVector& x, NodeVector& y) const;

  /// H of one cell; shape (24, 24), symmetric.
  CellMatrix cell_hessian(std::size_t cell) const;

  /// Cells of one number share their Hessian; -1 where a cell has its own.
  std::int32_t shared_hessian(std::size_t cell) const { return strain_ == Strain::cauchy ? elements_[cell] : -1; }

  const Mesh& mesh() const noexcept { return mesh_; }

private:
  /// A cell in its rotated frame at one state; the letters are those of THEORY.md.
  struct Frame {
    Mat3 r, s, inverse_m;
    CellVector y, f;  ///< R^T (x - mean x); K (y - X)
    Vec3 h;           ///< M^-1 sum y_a x f_a
  };
  Frame frame(std::size_t cell, const NodeVector& u) const;

  const Mesh& mesh_;
  std::vector<std::int32_t> elements_;
  std::vector<CellMatrix> stiffness_;
  Strain strain_;
  double stress_weight_ = 1;
  CellVector rest_;           ///< corners relative to the cell's centre
  NodeGradients gradients_;   ///< of N_a at the centre
  std::vector<Frame> frames_;  ///< of the last linearize()
};

}  // namespace hexsolver
