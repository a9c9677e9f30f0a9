// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <memory>
#include <unordered_map>
#include <vector>

#include "hexsolver/conjugate_gradients.h"
#include "hexsolver/constraints.h"
#include "hexsolver/potential.h"

namespace hexsolver {

/// The geometry of all multigrid levels below a mechanical level: made once, used by every Newton step.
struct Hierarchy {
  std::vector<Mesh> meshes;                 ///< [0] = the mechanical level
  std::vector<hexmesh::Merge> merges;       ///< [l]: cells of meshes[l] -> cells of meshes[l + 1]
  std::vector<Prolongation> prolongations;  ///< [l]: meshes[l + 1] -> meshes[l]

  /// @param coarsest_dofs  merge until a level has at most this many; up to Multigrid::most_dense a dense factor is
  /// made
  Hierarchy(Mesh finest, const Vec3& corner, std::size_t coarsest_dofs = usual_coarsest_dofs);
  static constexpr std::size_t usual_coarsest_dofs = 600;

  std::size_t bytes() const;  ///< of memory
};

/// One symmetric V-cycle as a preconditioner for P A P, A the Hessian and P the projection of the constraints.
///
/// Coarse operators are Galerkin products, cell by cell: K_parent = sum_c L_c^T K_c L_c of the current cell Hessians,
/// so no global matrix exists but the coarsest. The finest level works in the range of P, where the supports hold
/// exactly; coarser ones see them as w H^T H, cell-local and exact there (H_coarse = H P). Smoother: Chebyshev
/// polynomial of degree 6 on 3x3 block Jacobi.
class Multigrid final : public Preconditioner {
public:
  /// All three must outlive this.
  /// @param potential  linearized
  Multigrid(const Hierarchy& hierarchy, const Potential& potential, const Constraints& constraints);

  /// Make it anew for the potential as it is linearized now; the weights of supports stay. With a dense factor of the
  /// coarsest level, and no cells that share Hessians, it asks for no memory.
  void update();

  static constexpr std::size_t most_dense = 120;

  /// False where the coarsest matrix or a smoother's block is not positive definite: the Hessian is indefinite.
  bool is_positive() const noexcept { return positive_; }

  /// z = M^-1 r in the range of P, for r in it
  void apply(const NodeVector& r, NodeVector& z) const override;

  std::size_t bytes() const;  ///< of memory, without the factors of the coarsest level

private:
  using FloatMatrix = Eigen::Matrix<float, 24, 24>;
  struct Level {
    std::vector<std::int32_t> index;  ///< cell -> pool; empty on a finest level of unlike cells
    std::vector<FloatMatrix> pool;
    std::vector<Eigen::Matrix3f> inverse_diagonal;  ///< per node
    double largest_eigenvalue = 0;                  ///< of D^-1 A
    mutable FloatNodeVector b, x, r, d, t;          ///< work space of a cycle
  };

  void share_finest();
  void choose_support_weights();
  void coarsen(std::size_t level);
  bool invert_diagonal(Level& level, const std::vector<Mat3>& diagonal);
  void estimate_eigenvalue(std::size_t level);
  void factor_coarsest();
  void solve_coarsest(const FloatNodeVector& b, FloatNodeVector& x) const;
  CellMatrix cell_matrix(std::size_t level, std::size_t cell) const;
  void multiply(std::size_t level, const FloatNodeVector& x, FloatNodeVector& y) const;
  void scale_by_diagonal(std::size_t level, const FloatNodeVector& r, FloatNodeVector& d) const;
  void smooth(std::size_t level, const FloatNodeVector& b, FloatNodeVector& x, bool from_zero) const;
  void cycle(std::size_t level, const FloatNodeVector& b, FloatNodeVector& x) const;

  const Hierarchy& hierarchy_;
  const Potential& potential_;
  const Constraints& constraints_;
  std::unordered_map<std::size_t, std::vector<std::size_t>> points_of_cell_;  ///< constraint points, finest level
  std::vector<double> support_weight_;                                        ///< w of each condition [N/mm]
  std::vector<Level> levels_;
  mutable NodeVector wide_x_, wide_y_;  ///< for the operator of unlike cells, in double precision
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> coarsest_;
  Eigen::MatrixXd dense_matrix_;
  Eigen::LLT<Eigen::MatrixXd> dense_;  ///< in place of coarsest_ where that is small
  mutable NodeVector dense_x_;
  std::vector<Mat3> diagonal_;  ///< space for coarsen()
  std::vector<char> computes_;  ///< likewise
  bool positive_ = true;
};

}  // namespace hexsolver
