// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "kernels/batch_nodes.h"
#include "kernels/mirrored_matrix.h"

namespace hexsolver {

/// y += K x of the cells of a batch, all alike.
void add_alike_product(const AlikeMatrix<double>& k, const BatchNodes& nodes, const double* x, double* y);
void add_alike_product(const AlikeMatrix<float>& k, const BatchNodes& nodes, const float* x, float* y);

}  // namespace hexsolver
