// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "hexsolver/scene/effects.h"
#include "kernels/matrix_number.h"
#include "mesh/mesh.h"
#include "terms/couplings.h"

namespace hexsolver {

using NodeBlocks = std::array<Mat3, 8>;  ///< of the nodes of a cell

/// Projection of the Hessian (or filtering): how much of the negative curvature is left out, cell by cell, of the
/// second derivative of an energy that is not convex, from none to all of it.
struct Hessian {
  static constexpr double exact = 0, projected = 1;  ///< projected: positive semi-definite
  /// Of elastic cells: nor the change of a stressed cell's frame, so that rigid motions meet no resistance; else
  /// projected.
  static constexpr double without_stress = 2;
};

/// What of a cell's Hessian resists change of its volume, (bulk / volume) b b^T.
struct Dilatation {
  CellVector divergence = CellVector::Zero();  ///< b, with b . u = the volume gained [mm^2]
  double bulk = 0;                             ///< mean modulus over the filled part [MPa]; 0 = nothing
  double volume = 0;                           ///< of the filled part [mm^3]
  double shear = 0;                            ///< mean modulus over the filled part [MPa]

  double modulus() const { return bulk > 0 ? bulk / volume : 0; }
  CellMatrix hessian() const { return modulus() * divergence * divergence.transpose(); }
  Mat3 block(int a) const {  ///< of node a on the diagonal of hessian()
    return modulus() * divergence.segment<3>(3 * a) * divergence.segment<3>(3 * a).transpose();
  }
};

/// One part of the potential energy of a level, W(u), u the displacement of the nodes. A scene builds only those terms
/// that it calls for.
class Term {
public:
  virtual ~Term() = default;

  virtual EffectKind effect() const = 0;                          ///< that calls for it
  virtual std::string name() const { return name_of(effect()); }  ///< apart from others of the same effect

  virtual double energy(const NodeVector& u) const = 0;  ///< [N mm]

  /// The part of a step from u, at most 1, behind which it would not know its state.
  virtual double longest_step(const NodeVector& /*u*/, const NodeVector& /*step*/) const { return 1; }

  /// gradient += dW/du; magnitude += the absolute values that were summed up for it, the scale of a residual [N].
  virtual void add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const = 0;

  /// By how much its gradient may be off because it jumps near u, norm [N].
  virtual double gradient_jump(const NodeVector& /*u*/) const { return 0; }

  /// Size of the rounding errors in a gradient [N].
  virtual double rounding() const { return 0; }

  /// By how much its energy may be off by rounding at any u, where that is not of second order in the error of the
  /// gradient [N mm].
  virtual double energy_rounding() const { return 0; }

  virtual bool is_linear() const { return true; }  ///< its gradient in u

  /// Whether its gradient sums up displacements alone, which may be far smaller than the places of nodes.
  virtual bool adds_displacements_alone() const { return is_linear(); }

  /// False for forces that are no gradient: energy() is then only a measure of the state.
  virtual bool is_conservative() const { return true; }

  /// Energy, gradient and linearization at u are asked for next: what they share may be kept. Until linearize() is
  /// called the three below are of no state, but for linear terms, which have only one.
  virtual void move_to(const NodeVector& /*u*/) {}

  /// Prepare the three below at u. A term without second derivative leaves them as they are.
  /// @param projection  Hessian::exact to Hessian::projected; a term may take all that is not exact for projected
  virtual void linearize(const NodeVector& /*u*/, double /*projection*/) {}

  /// y += H x; in single precision for preconditioners
  virtual void add_product(const NodeVector& /*x*/, NodeVector& /*y*/) const {}
  virtual void add_product(const FloatNodeVector& /*x*/, FloatNodeVector& /*y*/) const {}

  /// h += H of one cell; shape (24, 24), symmetric.
  virtual void add_cell_hessian(std::size_t /*cell*/, CellMatrix& /*h*/) const {}

  /// blocks += the 3x3 blocks of the diagonal of the Hessian of one cell, or what is near to them.
  virtual void add_diagonal(std::size_t cell, NodeBlocks& blocks) const {
    CellMatrix h = CellMatrix::Zero();
    add_cell_hessian(cell, h);
    for (std::size_t a = 0; a < 8; ++a) {
      const auto n = static_cast<Eigen::Index>(3 * a);
      blocks[a] += h.block<3, 3>(n, n);
    }
  }

  /// What of add_cell_hessian() resists change of volume, where a term can tell it apart.
  virtual Dilatation dilatation(std::size_t /*cell*/) const { return {}; }

  /// Of the Hessian what couples points of different cells, which add_cell_hessian() leaves out; null: nothing.
  virtual const Couplings* couplings() const { return nullptr; }

  virtual std::size_t bytes() const { return 0; }  ///< of memory

  static constexpr std::int32_t no_hessian = no_matrix, own_hessian = own_matrix;
  /// Cells of one number, that of the element they are made of, share their Hessian.
  virtual std::int32_t shared_hessian(std::size_t /*cell*/) const { return no_hessian; }
};

}  // namespace hexsolver
