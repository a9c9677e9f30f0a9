// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstdint>

#include "core/parallel.h"
#include "hexmesh/core/index.h"

namespace hexsolver {

/// Vectors of one length to work with; r holds where to start from.
template <class Vector>
struct LanczosSpace {
  Vector &r, &z, &p, &q;
};

/// A number in [-1/2, 1/2] for a node or cell of a level and an axis: noise, the same for any number of processes.
/// Source: the finalizer of SplitMix64, Steele, Lea, Flood, OOPSLA (2014).
inline double noise_at(const hexmesh::Index3& index, std::uint64_t axis) {
  std::uint64_t z = (3 * hexmesh::sort_key(index) + axis + 1) * 0x9E3779B97F4A7C15U;
  z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9U;
  z = (z ^ z >> 27) * 0x94D049BB133111EBU;
  z ^= z >> 31;
  return static_cast<double>(z >> 40) / (1U << 24) - 0.5;
}

/// x . y of numbers that may be single.
template <class Vector>
double dot_in_double(const Vector& x, const Vector& y) {
  return x.template cast<double>().dot(y.template cast<double>());
}

/// The largest eigenvalue of S A, both symmetric, S positive: from below after few steps, so more by a margin. Lanczos'
/// process as conjugate gradients; the power iteration falls short by 10 % after as many steps where slivers make the
/// largest eigenvalues local. One that lies apart, of a few nodes, is found late: the process has come to rest below
/// it, and what a step adds grows again. So it goes on while that does. Source: Saad, Iterative Methods for Sparse
/// Linear Systems, 2nd ed. (2003), section 6.7.3.
/// @param multiply  q = A p
/// @param scale     z = S r
/// @param dot       x . y, in double precision
template <class Vector, class Multiply, class Scale, class Dot>
double largest_eigenvalue(const LanczosSpace<Vector>& space, const Multiply& multiply, const Scale& scale,
                          const Dot& dot) {
  constexpr int usual_steps = 12, most_steps = 48;
  constexpr double margin = 1.1, at_rest = 0.005;  // a step adds less than that part
  using Scalar = typename Vector::Scalar;
  auto& [r, z, p, q] = space;
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, most_steps, 1> diagonal(most_steps), beside(most_steps);
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, most_steps, most_steps>> eigen;
  double rz = 1, alpha = 1, largest = 1, added = 0;
  Eigen::Index steps = 0;
  const auto find_largest = [&] {
    eigen.computeFromTridiagonal(diagonal.head(steps), beside.head(steps - 1), Eigen::EigenvaluesOnly);
    return eigen.eigenvalues()[steps - 1];
  };
  for (bool goes_on = true; goes_on && steps < most_steps;) {
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
    ++steps;
    if (steps < usual_steps - 2) continue;  // of which nothing follows
    const double added_before = added, before = largest;
    largest = find_largest();
    added = largest - before;
    goes_on = steps < usual_steps || added > added_before || added > at_rest * largest;
  }
  if (steps > 0 && steps < usual_steps - 2) largest = find_largest();
  return margin * largest;
}

}  // namespace hexsolver
