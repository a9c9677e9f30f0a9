// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hexsolver {

/// y = K x, K (24, 24) symmetric, x and y of length 24; for the widest vectors of the machine it runs on.
void multiply24(const double* k, const double* x, double* y);
void multiply24(const float* k, const float* x, float* y);

struct TurnedCell;

/// out = R (Q^T K Q + E) R^T x; E, what the stress adds, only if `stressed`.
/// @param gradient  mean gradients of the eight nodes, components first as above
/// @param x, out    vectors of node 0, of node 1, ...
void multiply_turned(const double* k, const double* gradient, const TurnedCell& cell, bool stressed, const double* x,
                     double* out);

/// K += sum_r a_r b_r^T, K (24, 24) stored by columns, a_r and b_r the rows of arrays of shape (9, 24), stored by rows.
void add_products24(const double* a, const double* b, double* k);

}  // namespace hexsolver
