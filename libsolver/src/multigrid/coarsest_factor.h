// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <optional>
#include <vector>

#include "multigrid/multigrid.h"

namespace hexsolver {

/// The Cholesky factor of the coarsest level: dense up to Multigrid::most_dense degrees of freedom, which asks for
/// memory once only, or where patches fill it; else sparse.
class CoarsestFactor {
public:
  /// @param matrix_of  cell -> its matrix
  /// @param couplings  between cells
  /// @param held       where the level is the only one: it is solved at once with K + w (1 - P), which in the range of
  /// P
  ///                   is as good as P K P for large w. Null on others
  /// @returns whether the matrix is positive definite
  template <class MatrixOf>
  bool compute(const Mesh& mesh, const MatrixOf& matrix_of, const Couplings& couplings, const HeldDirections* held) {
    if (!is_dense_) is_dense_ = mesh.num_dofs() <= Multigrid::most_dense || (held && fills(*held, mesh.num_dofs()));
    return *is_dense_ ? compute_dense(mesh, matrix_of, couplings, held)
                      : compute_sparse(mesh, matrix_of, couplings, held);
  }

  template <class Vector>
  void solve(const Vector& b, Vector& x) const {
    using Scalar = typename Vector::Scalar;
    if (!*is_dense_) {
      x = sparse_.solve(b.template cast<double>()).template cast<Scalar>();
      return;
    }
    dense_x_ = b.template cast<double>();
    dense_.solveInPlace(dense_x_);
    x = dense_x_.template cast<Scalar>();
  }

private:
  using Index = Eigen::Index;
  static constexpr double held_over_nodal = 1e6;  ///< w over the largest diagonal entry of a cell

  /// Whether a patch couples so many nodes that a sparse factor is as good as full, and three times as slow.
  static bool fills(const HeldDirections& held, std::size_t num_dofs) {
    std::size_t entries = 0;
    held.for_each_held_entry([&](Index, Index, double) { ++entries; });
    return 12 * entries > num_dofs * num_dofs;
  }

  /// f(row, column, block) for the blocks of the matrix of a cell, at the free nodes.
  template <class F>
  static void for_each_block(const Mesh& mesh, std::size_t cell, const CellMatrix& k, const F& f) {
    for (std::size_t a = 0; a < 8; ++a)
      for (std::size_t b = 0; b < 8; ++b) {
        const Mat3 block = k.block<3, 3>(static_cast<Index>(3 * a), static_cast<Index>(3 * b));
        mesh.for_each_free(cell, a, [&](std::int32_t row, double of_row) {
          mesh.for_each_free(cell, b, [&](std::int32_t column, double of_column) {
            f(3 * Index{row}, 3 * Index{column}, of_row * of_column * block);
          });
        });
      }
  }

  template <class MatrixOf>
  bool compute_dense(const Mesh& mesh, const MatrixOf& matrix_of, const Couplings& couplings,
                     const HeldDirections* held) {
    const auto size = static_cast<Index>(mesh.num_dofs());
    dense_matrix_.setZero(size, size);
    double largest = 0;
    for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
      const CellMatrix k = matrix_of(c);
      largest = std::max(largest, k.diagonal().maxCoeff());
      for_each_block(mesh, c, k, [&](Index row, Index column, const Mat3& block) {
        dense_matrix_.block<3, 3>(row, column) += block;
      });
    }
    couplings.for_each_block(mesh, [&](std::int32_t row, std::int32_t column, const Mat3& block) {
      dense_matrix_.block<3, 3>(3 * Index{row}, 3 * Index{column}) += block;
    });
    if (held)
      held->for_each_held_entry([&](Index row, Index column, double value) {
        dense_matrix_(row, column) += held_over_nodal * largest * value;
      });
    dense_.compute(dense_matrix_);
    return dense_.info() == Eigen::Success;
  }

  template <class MatrixOf>
  bool compute_sparse(const Mesh& mesh, const MatrixOf& matrix_of, const Couplings& couplings,
                      const HeldDirections* held) {
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(576 * mesh.num_cells());
    double largest = 0;
    for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
      const CellMatrix k = matrix_of(c);
      largest = std::max(largest, k.diagonal().maxCoeff());
      for_each_block(mesh, c, k, [&](Index first_row, Index first_column, const Mat3& block) {
        for (int column = 0; column < 3; ++column)
          for (int row = 0; row < 3; ++row)
            entries.emplace_back(first_row + row, first_column + column, block(row, column));
      });
    }
    couplings.for_each_block(mesh, [&](std::int32_t first_row, std::int32_t first_column, const Mat3& block) {
      for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row)
          entries.emplace_back(3 * Index{first_row} + row, 3 * Index{first_column} + column, block(row, column));
    });
    if (held)
      held->for_each_held_entry([&](Index row, Index column, double value) {
        entries.emplace_back(row, column, held_over_nodal * largest * value);
      });
    const auto size = static_cast<Index>(mesh.num_dofs());
    Eigen::SparseMatrix<double> matrix(size, size);
    matrix.setFromTriplets(entries.begin(), entries.end());
    sparse_.compute(matrix);
    return sparse_.info() == Eigen::Success;
  }

  std::optional<bool> is_dense_;  ///< as the first compute() found: what is held stays
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> sparse_;
  Eigen::MatrixXd dense_matrix_;
  Eigen::LLT<Eigen::MatrixXd> dense_;
  mutable NodeVector dense_x_;  ///< space to work in
};

}  // namespace hexsolver
