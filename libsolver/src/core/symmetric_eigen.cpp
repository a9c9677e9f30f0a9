// SPDX-License-Identifier: Apache-2.0
#include "core/symmetric_eigen.h"

#include <Eigen/Eigenvalues>

namespace hexsolver {

SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& a) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(a);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

}  // namespace hexsolver
