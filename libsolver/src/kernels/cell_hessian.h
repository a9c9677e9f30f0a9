// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mesh/mesh.h"

namespace hexsolver {

/// y = K x, K (24, 24) symmetric, x and y of length 24; for the widest vectors of the machine it runs on.
void multiply24(const double* k, const double* x, double* y);

/// y_a = M x_b, y_b = M^T x_a, M (24, 24) stored by columns.
void multiply24_both(const double* m, const double* x_a, const double* x_b, double* y_a, double* y_b);

/// H += R (K + T^T B + B^T T + Z^T Z) R^T, node by node. K and H (24, 24) symmetric.
/// @param t, b, z  shape (3, 24), stored by rows; z may be null
/// @param r        (3, 3) stored by columns
void add_rotated_hessian(const double* k, const double* t, const double* b, const double* z, const double* r,
                         double* h);

/// Where a child is in its parent.
struct Slot {
  int number;
  Index3 factor;  ///< children along each axis, 1 or 2
};

/// K <- L^T K L, K (24, 24) symmetric, L the trilinear interpolation from the nodes of a parent to those of its child.
void interpolate_from_parent(const Slot& slot, double* k);
/// M <- L_a^T M L_b, M (24, 24) stored by columns.
void interpolate_from_parents(const Slot& a, const Slot& b, double* m);

/// K += sum_r a_r b_r^T, K (24, 24) stored by columns, a_r and b_r the rows of arrays of shape (9, 24), stored by rows.
void add_products24(const double* a, const double* b, double* k);

/// M += H_a^T A H_b, M (24, 24) stored by columns.
/// @param of_a, of_b  weights of eight nodes, H
/// @param a           (3, 3) stored by columns
void add_point_product(const double* of_a, const double* of_b, const double* a, double* m);

}  // namespace hexsolver
