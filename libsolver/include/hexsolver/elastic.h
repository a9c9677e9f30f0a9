// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hexmesh/lattice/element.h"
#include "hexsolver/mesh.h"
#include "hexsolver/rotation.h"

namespace hexsolver {

enum class Strain { cauchy, corotational };
enum class Volumetric { mean, full };

/// The Hessian of a co-rotational cell is Q^T K Q + E with E of rank 6, three of its eigenvalues negative or zero.
enum class Hessian {
  exact,
  clamped  ///< with the positive part of E only: positive semi-definite cell by cell
};

/// What cells alike share.
struct ElementModel {
  CellMatrix stiffness;         ///< K [N/mm]
  NodeGradients mean_gradient;  ///< of N_a over the filled part, b / V [1/mm]
};

ElementModel make_element_model(const hexmesh::ElementMatrices& matrices, const hexmesh::Element& element,
                                Volumetric volumetric);

/// The elastic energy of all cells of one level.
///
///   Cauchy:         W(u) = 1/2 u^T K u                                             (1)
///   co-rotational:  W(x) = 1/2 (R^T x - X)^T K (R^T x - X), R = polar(F),          (2)
///                   F = grad x averaged over the filled part of the cell
///
/// In a full cell F is the paper's average of the four edges per direction; in a partly filled one it is the rotation
/// of the material rather than of corners far from it, which the energy is hardly aware of.
/// The gradient and the Hessian of (2) are exact, with R a function of x, so the forces of a cell have no net force and
/// no net torque. Derivation: THEORY.md, "Co-rotational cells". Source of (2) with R held: Nesme, Faure, Payan 2010.
class Elastic {
public:
  /// @param elements  number of the model of each cell
  Elastic(const Mesh& mesh, std::vector<std::int32_t> elements, std::vector<ElementModel> models, Strain strain);

  bool is_linear() const noexcept { return strain_ == Strain::cauchy; }

  double energy(const NodeVector& u) const;                      ///< [N mm]
  std::vector<double> cell_energies(const NodeVector& u) const;  ///< [N mm]

  /// Gradient = internal forces [N]; magnitude = sum over cells of their absolute values, the scale of a residual.
  void gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const;

  /// Size of the rounding errors in a gradient, 50 eps |sum over cells of |K| |X|| [N].
  double rounding() const noexcept { return rounding_; }

  /// Prepare apply() and cell_hessian() at u.
  void linearize(const NodeVector& u, Hessian which);

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
  /// The stress term E = T^T A T + T^T L + L^T T, with w = T v the rotation that v causes.
  struct StressTerm {
    Eigen::Matrix<double, 3, 24> t, l;
    Mat3 a;
  };
  using Columns = Eigen::Matrix<double, 24, 3>;

  Frame frame(std::size_t cell, const NodeVector& u) const;
  StressTerm stress_term(const Frame& f, const NodeGradients& gradient) const;
  const ElementModel& model(std::size_t cell) const { return models_[static_cast<std::size_t>(elements_[cell])]; }
  static Columns positive_part(const StressTerm& e);  ///< Z with Z Z^T = the positive part of E

  const Mesh& mesh_;
  std::vector<std::int32_t> elements_;
  std::vector<ElementModel> models_;
  Strain strain_;
  double rounding_ = 0;
  CellVector rest_;                ///< corners relative to the cell's centre
  std::vector<Frame> frames_;      ///< of the last linearize()
  std::vector<Columns> positive_;  ///< likewise, empty where it is exact
};

}  // namespace hexsolver
