// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <unordered_map>
#include <vector>

#include "kernels/cell_matrices.h"
#include "multigrid/braess_sarazin.h"
#include "multigrid/coarsest_factor.h"
#include "multigrid/multigrid.h"
#include "multigrid/private_nodes.h"

namespace hexsolver {

/// What a Multigrid works with.
class Multigrid::Cycles {
public:
  virtual ~Cycles() = default;
  virtual void update() = 0;
  virtual bool is_positive() const noexcept = 0;
  virtual void smooth_carefully() = 0;
  virtual void apply(const NodeVector& r, NodeVector& z) const = 0;
  virtual std::size_t bytes() const = 0;
};

/// V-cycles in single or double precision.
template <class Scalar>
class Multigrid::CyclesOf final : public Multigrid::Cycles {
public:
  CyclesOf(const Hierarchy& hierarchy, const Potential& potential, const HeldDirections& constraints);
  void update() override;
  bool is_positive() const noexcept override { return positive_; }
  void smooth_carefully() override;
  void apply(const NodeVector& r, NodeVector& z) const override;
  std::size_t bytes() const override;

private:
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  using Block = Eigen::Matrix<Scalar, 3, 3>;
  using Point = Eigen::Matrix<Scalar, 3, 1>;
  struct Level {
    CellMatrices<Scalar> matrices;        ///< none on the finest level, whose operator is the potential's
    Couplings couplings;                  ///< likewise, beside the matrices of cells
    std::vector<Block> inverse_diagonal;  ///< D^-1 per node
    double largest_eigenvalue = 0;        ///< of D^-1 A
    std::unique_ptr<BraessSarazinSmoother<Scalar>> braess_sarazin;  ///< where cells are nearly incompressible
    mutable Vector b, x, r, d, t;                                   ///< work space of a cycle
    mutable OfAllNodes<Vector> of_all_nodes;                        ///< likewise
  };

  bool needs_braess_sarazin() const;
  /// Null where this process has the whole level.
  const Subdomain* part(std::size_t level) const { return hierarchy_.subdomain(level); }
  /// Whether processes have parts of the level before, and each the whole of this.
  bool is_gathered(std::size_t level) const { return level > 0 && part(level - 1) && !part(level); }
  void prepare_smoothing();
  void choose_support_weights();

  // Coarse operators: coarsening.cpp.
  void coarsen(std::size_t level);
  std::vector<std::size_t> share_matrices(std::size_t level);
  std::int32_t shared_number(std::size_t level, std::size_t cell) const;
  std::vector<std::int32_t> shared_by_parents(std::size_t level, std::vector<std::size_t>& first_of) const;
  void set_dilatations(std::size_t level);
  Dilatation sum_of_dilatations(std::size_t level, std::size_t parent) const;
  std::vector<Dilatation> gather_dilatations(std::size_t level) const;
  void gather_matrices(std::size_t level);
  CellMatrix sum_of_children(std::size_t level, std::size_t parent, bool computes);
  CellMatrix cell_matrix(std::size_t level, std::size_t cell) const;
  bool invert_diagonal(Level& level, const std::vector<Mat3>& diagonal);

  void estimate_eigenvalue(std::size_t level);
  void weigh_shape(std::size_t level);
  void divide_inverse_diagonal(std::size_t level, double by);
  void factor_coarsest();

  void multiply(std::size_t level, const Vector& x, Vector& y) const;
  void scale_by_diagonal(std::size_t level, const Vector& r, Vector& d) const;
  void smooth(std::size_t level, const Vector& b, Vector& x, bool from_zero) const;
  void smooth_by_chebyshev(std::size_t level, const Vector& b, Vector& x, bool from_zero) const;
  void restrict_to_coarser(std::size_t level) const;
  void cycle(std::size_t level, const Vector& b, Vector& x) const;

  const Hierarchy& hierarchy_;
  const Potential& potential_;
  const HeldDirections& constraints_;
  const bool is_solved_at_once_;  ///< see Hierarchy: a factor, with the supports held, and no smoothing
  std::unordered_map<std::size_t, std::vector<std::size_t>> points_of_cell_;  ///< constraint points, finest level
  std::vector<double> support_weight_;                                        ///< w of each condition [N/mm]
  std::vector<Level> levels_;
  CoarsestFactor coarsest_;
  std::unique_ptr<PrivateNodes> private_nodes_;  ///< of graded meshes
  mutable NodeVector residual_;                  ///< space for these
  std::vector<Mat3> diagonal_;                   ///< space for coarsen()
  bool positive_ = true;
};

}  // namespace hexsolver
