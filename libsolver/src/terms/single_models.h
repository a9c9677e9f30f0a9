// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "kernels/cell_matrices.h"
#include "terms/elastic.h"

namespace hexsolver {

struct ElasticCells::SingleModels {
  CellMatrices<float> stiffness;
  std::vector<Eigen::Matrix<float, 8, 3>> mean_gradient;  ///< of each model
};

}  // namespace hexsolver
