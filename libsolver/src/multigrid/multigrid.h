// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "constraints/constraints.h"
#include "linear/conjugate_gradients.h"
#include "mesh/hierarchy.h"
#include "terms/potential.h"

namespace hexsolver {

/// One symmetric V-cycle as a preconditioner for P A P, A the Hessian and P the projection of the constraints.
///
/// Coarse operators are Galerkin products, cell by cell: K_parent = sum_c L_c^T K_c L_c of the current cell Hessians,
/// so no global matrix exists but the coarsest. The finest level works in the range of P, where the supports hold
/// exactly; coarser ones see them as w H^T H, cell-local and exact there (H_coarse = H P). Smoother: Chebyshev
/// polynomial of degree 6 on 3x3 block Jacobi. Near-incompressible bodies have coarse cells that resist change of their
/// own volume only, and the Braess-Sarazin smoother. In single precision, scaled to the residual, unless the hierarchy
/// asks for double, or it is positive in double alone: thin bodies bend so easily that single sees nothing of it.
class Multigrid final : public Preconditioner {
public:
  /// All three must outlive this. Of a body that several processes have, all make theirs at once, and call all but
  /// bytes() at once.
  /// @param potential    linearized, of the cells of this process
  /// @param constraints  likewise
  Multigrid(const Hierarchy& hierarchy, const Potential& potential, const HeldDirections& constraints);
  ~Multigrid() override;

  /// Make it anew for the potential as it is linearized now; the weights of supports stay. With a dense factor of the
  /// coarsest level, and no cells that share Hessians, it asks for no memory.
  void update();

  static constexpr std::size_t most_dense = 120;  ///< degrees of freedom of a coarsest level with a dense factor

  /// Whether a body of mean dilatation with this largest ratio of bulk and shear modulus has the Braess-Sarazin
  /// smoother, which pays for Poisson's ratios of 0.452 to 0.4995: below, block Jacobi is as fast in less memory;
  /// above, it takes so many steps for the pressures that block Jacobi is faster.
  static constexpr bool needs_braess_sarazin(double ratio) { return ratio > 10 && ratio < 1000; }

  /// False where the coarsest matrix or a smoother's block is not positive definite: the Hessian is indefinite.
  bool is_positive() const noexcept;

  /// Smooth as if the largest eigenvalues, which a few steps find from below, were half as large again: where one was
  /// missed the cycle is not positive.
  void smooth_carefully();

  /// z = M^-1 r in the range of P, for r in it
  void apply(const NodeVector& r, NodeVector& z) const override;

  std::size_t bytes() const;  ///< of memory, without the factors of the coarsest level

private:
  class Cycles;
  template <class Scalar>
  class CyclesOf;
  std::unique_ptr<Cycles> cycles_;
};

}  // namespace hexsolver
