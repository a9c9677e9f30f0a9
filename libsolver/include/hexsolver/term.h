// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "hexsolver/mesh.h"

namespace hexsolver {

/// How much of the negative curvature is left out, cell by cell, of the second derivative of an energy that is not
/// convex: from none to all of it.
struct Hessian {
  static constexpr double exact = 0, clamped = 1;  ///< clamped: positive semi-definite
};

/// One part of the potential energy of a level, W(u), u the displacement of the nodes. A scene builds only those terms
/// that it calls for.
class Term {
public:
  virtual ~Term() = default;

  virtual std::string name() const = 0;

  /// The part of the prescribed loads that acts, 0 to 1.
  virtual void set_load_fraction(double /*fraction*/) {}

  virtual double energy(const NodeVector& u) const = 0;  ///< [N mm]

  /// gradient += dW/du; magnitude += the absolute values that were summed up for it, the scale of a residual [N].
  virtual void add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const = 0;

  /// Size of the rounding errors in a gradient [N].
  virtual double rounding() const { return 0; }

  virtual bool is_linear() const { return true; }  ///< its gradient in u

  /// False for forces that are no gradient: energy() is then only a measure of the state.
  virtual bool is_conservative() const { return true; }

  /// Prepare the three below at u. A term without second derivative leaves them as they are.
  /// @param clamping  Hessian::exact to Hessian::clamped; a term may take all that is not exact for clamped
  virtual void linearize(const NodeVector& /*u*/, double /*clamping*/) {}

  /// y += H x
  virtual void add_product(const NodeVector& /*x*/, NodeVector& /*y*/) const {}

  /// h += H of one cell; shape (24, 24), symmetric.
  virtual void add_cell_hessian(std::size_t /*cell*/, CellMatrix& /*h*/) const {}

  virtual std::size_t bytes() const { return 0; }  ///< of memory

  static constexpr std::int32_t no_hessian = -1, own_hessian = -2;
  /// Cells of one number share their Hessian.
  virtual std::int32_t shared_hessian(std::size_t /*cell*/) const { return no_hessian; }
};

}  // namespace hexsolver
