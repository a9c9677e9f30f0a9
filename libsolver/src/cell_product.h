// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hexsolver {

/// y = K x, K (24, 24) symmetric, x and y of length 24; for the widest vectors of the machine it runs on.
void multiply24(const double* k, const double* x, double* y);
void multiply24(const float* k, const float* x, float* y);

struct TurnedCells;

/// x <- R (Q^T K Q + E) R^T x of each lane; E, what the stress adds, only if `stressed`.
/// @param k       of each lane, (24, 24) symmetric
/// @param shared  all are the same
/// @param x       shape (24, 8), aligned to 64 bytes: vectors of node 0, of node 1, ...; lanes side by side
void multiply_turned(const double* const* k, bool shared, const TurnedCells& cells, bool stressed, double* x);

/// The forces R (f - h x g) of each lane on its nodes.
/// @param out  shape (24, 8) as above
void forces_of_turned(const TurnedCells& cells, double* out);

/// K += sum_r a_r b_r^T, K (24, 24) stored by columns, a_r and b_r the rows of arrays of shape (9, 24), stored by rows.
void add_products24(const double* a, const double* b, double* k);

}  // namespace hexsolver
