// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "mesh/mesh.h"

namespace hexsolver {

/// Nodes that one cell alone has, of cells that hold so little material that these nodes are soft together, though each
/// alone is not: one voxel in a cell of 512, say. Block Jacobi knows nothing of that, and where large cells stand
/// beside small ones no coarser level has another cell for them. They are solved for exactly, cell by cell, before a
/// cycle and after it, which is as if they were no unknowns (symmetric multiplicative Schwarz).
class PrivateNodes {
public:
  /// @param mesh          must outlive this
  /// @param is_left_out   cells whose nodes are held, or coupled with those of others otherwise
  PrivateNodes(const Mesh& mesh, const std::function<bool(std::size_t cell)>& is_left_out);

  /// @param hessian_of  cell -> its matrix; empty: cells are coupled otherwise than by nodes, and none is solved for
  void update(const std::function<CellMatrix(std::size_t cell)>& hessian_of);

  bool any() const noexcept { return num_soft_ > 0; }
  /// r <- what is left for the others once these nodes are where r takes them.
  void solve_first(NodeVector& r) const;
  /// These nodes of z to where r takes them, the others as they are in z.
  void solve_last(const NodeVector& r, NodeVector& z) const;

  std::size_t bytes() const;

private:
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 24, 1>;
  struct Cell {
    std::size_t cell = 0;
    std::vector<std::size_t> corners;  ///< whose nodes no other cell has
    CellMatrix k;
    Eigen::MatrixXd inverse;  ///< of its part of k
  };
  static bool invert(Cell& of);
  Vector at_corners(const Cell& of, const NodeVector& v) const;

  const Mesh& mesh_;
  std::vector<Cell> cells_;  ///< the soft ones come first
  std::size_t num_soft_ = 0;
};

}  // namespace hexsolver
