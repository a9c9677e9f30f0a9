// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexsolver/core/vectors.h"

namespace hexsolver {

// What Newton's method does with fields. Fields of many processes have the same functions (distributed/petsc.h).

inline double dot(const NodeVector& x, const NodeVector& y) { return x.dot(y); }
inline double norm(const NodeVector& x) { return x.norm(); }
inline double largest(const NodeVector& x) { return x.lpNorm<Eigen::Infinity>(); }
inline NodeVector copy_of(const NodeVector& x) { return x; }
inline void set_to(NodeVector& to, const NodeVector& from) { to = from; }
inline void negate(NodeVector& x) { x = -x; }
/// out = x + a y
inline void set_sum(NodeVector& out, const NodeVector& x, double a, const NodeVector& y) { out = x + a * y; }
inline void swap_fields(NodeVector& x, NodeVector& y) { x.swap(y); }

}  // namespace hexsolver
