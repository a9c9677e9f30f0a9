// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "terms/hyperelastic.h"

namespace hexsolver {

/// What tetrahedra are made of, for comparison with cells; mu and lambda as for cells.
enum class TetLaw {
  cauchy,        ///< small strain, Hooke
  corotational,  ///< W(F) = mu |S - 1|^2 + lambda/2 tr(S - 1)^2, F = R S by polar decomposition
  /// The paper's fast tetrahedra: R from a tetrahedron's edges by Gram-Schmidt, held while forces are taken; its
  /// forces are no gradient. Source: Nesme, Payan, Faure, "Efficient, physically plausible finite elements" (2005).
  corotational_qr,
  green_lagrange  ///< St. Venant and Kirchhoff's
};

/// Energy, stress and tangent of a law at a gradient of deformation.
struct TetState {
  double energy = 0;  ///< per volume [MPa]
  Mat3 stress;        ///< first Piola-Kirchhoff [MPa]
  Tangent tangent;    ///< its derivative
};

/// @param f      gradient of deformation
/// @param edges  three edges of the tetrahedron at rest, as columns; only corotational_qr looks at them
TetState tet_state(TetLaw law, const Mat3& f, const Mat3& edges, double shear, double lambda);

/// As a matrix: entries (i, j) of a 3x3 matrix at i + 3 j, dP = M dF.
Eigen::Matrix<double, 9, 9> tangent_matrix(const Tangent& tangent);

}  // namespace hexsolver
