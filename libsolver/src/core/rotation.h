// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexsolver/core/vectors.h"

namespace hexsolver {

/// F = R S with R a proper rotation, also where F is flat or inverted, and what its derivative needs.
struct Polar {
  Mat3 rotation;  ///< R, det = +1
  Mat3 stretch;   ///< S = R^T F, symmetric
  /// M^-1 with M = tr(S) I - S, whose eigenvalues sigma_i + sigma_j are floored at `polar_floor`:
  /// for a change dF, dR = R [w]x with M w = axial(R^T dF - dF^T R).
  Mat3 inverse_m;
};

inline constexpr double polar_floor = 0.05;
/// Higham's iteration is for F that are not flat: q = |F|^2 / 3 above this, and det F above that part of q^(3/2) ...
inline constexpr double polar_least_scale = 0.04, polar_least_jacobian = 0.05;
inline constexpr double polar_settled = 1e-28;  ///< ... and ends where R changes by less, squared

/// Inverted cells keep the sign with the smallest singular value, so that they recover along the shortest way.
/// Sources: Higham, SIAM J. Sci. Stat. Comput. 7 (1986) 1160 (the iteration); Irving et al., SCA 2004 (inversion).
Polar polar_decomposition(const Mat3& f);

double rotation_angle(const Mat3& rotation);  ///< [rad], 0 to pi

/// The rotation whose first column points along f's first and whose second lies in the plane of its first two
/// (Gram-Schmidt, the paper's), defined for any F: a column that vanishes or is parallel to one before is replaced by
/// the coordinate axis, of those that are free, farthest from it.
Mat3 orthonormalized(const Mat3& f);

/// [v]x
inline Mat3 cross_matrix(const Vec3& v) {
  Mat3 m;
  m << 0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0;
  return m;
}

}  // namespace hexsolver
