// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <functional>
#include <vector>

#include "constraints/constraints.h"
#include "core/parallel.h"
#include "mesh/subdomain.h"
#include "multigrid/pressure_schur_complement.h"

namespace hexsolver {

/// The Braess-Sarazin smoother, for nearly incompressible cells. K = A + B^T B, row c of B is (bulk / volume)^1/2 times
/// the volume that cell c gains; M = D + B^T B with D in blocks (3, 3) per node, a multiple of those of A. M^-1 by so
/// many steps of Chebyshev iteration for the pressures that changes of volume come out within 1 +- `accuracy` of what
/// they are, and changes of shape never larger: a fixed polynomial, symmetric and positive. On the finest level D^-1
/// stands for P D^-1 P, P the projection of the constraints. Source: Braess and Sarazin, An efficient smoother for the
/// Stokes problem (1997); Schoeberl, Multigrid methods for a parameter dependent problem in primal variables (1999).
template <class Real>
class BraessSarazinSmoother {
public:
  using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
  using Block = Eigen::Matrix<Real, 3, 3>;
  using Product = std::function<void(const Vector& x, Vector& y)>;
  static constexpr double accuracy = 0.7;

  /// All must outlive this.
  /// @param constraints  of the finest level; null on others
  /// @param part         null where this process has the whole mesh; then all below but get() and bytes() are called by
  ///                     all processes at once
  BraessSarazinSmoother(const Mesh& mesh, const HeldDirections* constraints, const Subdomain* part = nullptr);

  /// @param of      cell -> Dilatation
  /// @param shared  cell -> its number; cells of one number >= 0 have the same
  template <class Of, class Shared>
  void set(const Of& of, const Shared& shared) {
    const auto row_of = [&](std::size_t c) {
      const Dilatation d = of(c);
      const double root = std::sqrt(d.modulus());
      root_[c] = static_cast<Real>(root);
      volume_[c] = static_cast<Real>(d.volume);
      return CellVector(root * d.divergence);
    };
    rows_.set(row_of, shared);
    copy_to_shared();
  }
  Dilatation get(std::size_t cell) const;

  void subtract_product(const Vector& x, Vector& y) const;  ///< y -= B^T B x

  /// Whenever B or D are new.
  /// @param inverse  D^-1 per node; must outlive this
  void prepare(const std::vector<Block>& inverse);

  /// Space for vectors of the nodes.
  struct Space {
    Vector &r, &d, &t;
  };
  /// x <- an approximation of K^-1 b from x or from 0: a polynomial in M^-1 K. On the finest level b = P b.
  /// @param multiply  y = K x, on the finest level P K x
  /// @param degree    1: x += M^-1 (b - K x)
  void smooth(const Product& multiply, const Vector& b, Vector& x, bool from_zero, const Space& space,
              int degree = 3) const;

  std::size_t bytes() const;  ///< of memory

private:
  using Point = Eigen::Matrix<Real, 3, 1>;
  struct HeldCorner {
    std::size_t cell;
    std::size_t corner;
    Real weight;  ///< of the node in the corner
    std::int32_t node;
    Point of_row;  ///< of B
  };
  static constexpr int most_steps = 100;

  void find_held_corners();
  void copy_to_shared();
  Real& pressure(std::size_t cell) const { return pressures_[schur_complement_.place(cell)]; }
  template <class Put>
  void gain(const Vector& of_free, const Put& put) const;
  template <class Pressure>
  void add_forces(const Pressure& of_cell, Vector& f) const;
  void step(const PressureStep<Real>& step) const;
  void step_held(Real add) const;
  void choose_steps(double largest);
  void find_pressures(Vector& z) const;
  void add_pressures(Vector& f) const;

  const Mesh& mesh_;
  const HeldDirections* constraints_;
  const Subdomain* part_;
  CellRows<Real> rows_;   ///< of B
  Vector root_, volume_;  ///< of each cell: (bulk / volume)^1/2, volume [mm^3]
  const std::vector<Block>* inverse_ = nullptr;
  PressureSchurComplement<Real> schur_complement_;  ///< S = B D^-1 B^T without held nodes
  std::vector<PressureStep<Real>> steps_;           ///< but the last, which comes to
  Real of_residual_ = 1;                            ///< M^-1 r = D^-1 (of_residual r + B^T p)

  std::vector<bool> is_held_;  ///< nodes that the projection moves, or that other processes have too
  std::vector<std::int32_t> held_nodes_;
  std::vector<HeldCorner> held_corners_;

  // Space to work in.
  mutable Vector gained_, pressures_, before_;  ///< at the places of schur_complement_
  mutable Vector forces_, nodes_, all_nodes_;   ///< of the nodes
  mutable std::array<Vector, 4> of_cells_;
};

}  // namespace hexsolver
