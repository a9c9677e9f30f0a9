// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hexmesh/lattice/merge.h"
#include "mesh/mesh.h"

namespace hexsolver {

/// Trilinear interpolation from the nodes of a coarser mesh: u_fine = P u_coarse, for each component alike.
class Prolongation {
public:
  /// @param merge  of the fine cells into the coarse ones, in the order of `coarse`
  Prolongation(const Mesh& fine, const Mesh& coarse, const hexmesh::Merge& merge);
  /// @param parents  the coarse cell that each fine one is in
  /// @param ratio    edges of the finest fine cells in one of the finest coarse cells, axis by axis
  Prolongation(const Mesh& fine, const Mesh& coarse, const std::vector<std::int32_t>& parents, const Index3& ratio);

  void prolongate(const NodeVector& coarse, NodeVector& fine) const;             ///< fine = P coarse
  void prolongate(const FloatNodeVector& coarse, FloatNodeVector& fine) const;   ///< likewise
  void restrict_to(const NodeVector& fine, NodeVector& coarse) const;            ///< coarse = P^T fine
  void restrict_to(const FloatNodeVector& fine, FloatNodeVector& coarse) const;  ///< likewise

  std::size_t bytes() const { return forward_.bytes() + transposed_.bytes(); }  ///< of memory

private:
  /// @param indices  of the coarse cells, as the fine nodes count
  void fill(const Mesh& fine, const Mesh& coarse, const std::vector<std::int32_t>& parent_of_node, const Index3& ratio,
            const std::vector<Index3>& indices);

  /// Compressed rows: row r holds columns_[begin_[r]] ... columns_[begin_[r + 1] - 1].
  struct Rows {
    std::vector<std::int32_t> begin, columns;
    std::vector<float> weights;
    template <class Scalar>
    void multiply(const Eigen::Matrix<Scalar, Eigen::Dynamic, 1>& x, Eigen::Matrix<Scalar, Eigen::Dynamic, 1>& y) const;
    std::size_t bytes() const;
  };
  Rows forward_, transposed_;
};

}  // namespace hexsolver
