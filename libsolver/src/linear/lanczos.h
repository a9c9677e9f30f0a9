// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstdint>

#include "core/parallel.h"

namespace hexsolver {

/// Vectors of one length to work with; r holds where to start from.
template <class Vector>
struct LanczosSpace {
  Vector &r, &z, &p, &q;
};

/// v = numbers in [-1/2, 1/2], always the same.
/// @param process  another one, other numbers
template <class Vector>
void fill_roughly(Vector& v, Eigen::Index size, int process = 0) {
  using Scalar = typename Vector::Scalar;
  v.resize(size);
  std::uint32_t state = 12345U + 2654435769U * static_cast<std::uint32_t>(process);
  for (Scalar& x : v) {
    state = state * 1664525U + 1013904223U;
    x = static_cast<Scalar>(state >> 8) / (1U << 24) - Scalar(0.5);
  }
}

/// x . y of numbers that may be single.
template <class Vector>
double dot_in_double(const Vector& x, const Vector& y) {
  return x.template cast<double>().dot(y.template cast<double>());
}

/// The largest eigenvalue of S A, both symmetric, S positive: from below after few steps, so more by a margin. Lanczos'
/// process as conjugate gradients; the power iteration falls short by 10 % after as many steps where slivers make the
/// largest eigenvalues local. Source: Saad, Iterative Methods for Sparse Linear Systems, 2nd ed. (2003), section 6.7.3.
/// @param multiply  q = A p
/// @param scale     z = S r
/// @param dot       x . y, in double precision
template <class Vector, class Multiply, class Scale, class Dot>
double largest_eigenvalue(const LanczosSpace<Vector>& space, const Multiply& multiply, const Scale& scale,
                          const Dot& dot) {
  constexpr int most_steps = 12;
  constexpr double margin = 1.1;
  using Scalar = typename Vector::Scalar;
  auto& [r, z, p, q] = space;
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, most_steps, 1> diagonal(most_steps), beside(most_steps);
  double rz = 1, alpha = 1;
  Eigen::Index steps = 0;
  for (; steps < most_steps; ++steps) {
    scale(r, z);
    const double rz_next = dot(r, z), beta = steps == 0 ? 0 : rz_next / rz;
    if (!(rz_next > 0)) break;
    if (steps == 0)
      p = z;
    else
      p = z + static_cast<Scalar>(beta) * p;
    multiply(p, q);
    const double curvature = dot(p, q);
    if (!(curvature > 0)) break;
    diagonal[steps] = curvature / rz_next + beta / alpha;
    if (steps > 0) beside[steps - 1] = std::sqrt(beta) / alpha;
    alpha = rz_next / curvature;
    rz = rz_next;
    r -= static_cast<Scalar>(alpha) * q;
  }
  if (steps == 0) return margin;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, most_steps, most_steps>> eigen;
  eigen.computeFromTridiagonal(diagonal.head(steps), beside.head(steps - 1), Eigen::EigenvaluesOnly);
  return margin * eigen.eigenvalues()[steps - 1];
}

}  // namespace hexsolver
