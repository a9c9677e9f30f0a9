// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace hexsolver {

/// Of a symmetric matrix a: a = vectors diag(values) vectorsᵀ.
struct SymmetricEigen {
  Eigen::VectorXd values;   ///< ascending
  Eigen::MatrixXd vectors;  ///< a column each, of length 1
};

/// One function for all sizes: Eigen's decomposition takes a compiler eight seconds for each type of matrix.
SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& a);

}  // namespace hexsolver
