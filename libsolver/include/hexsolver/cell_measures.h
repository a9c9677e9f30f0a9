// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <vector>

#include "hexsolver/elastic.h"

namespace hexsolver {

/// What the cells of a level went through, from F, the mean gradient over the filled part of each.
struct CellMeasures {
  std::array<std::vector<double>, 3> principal_stretch;  ///< singular values of F, the largest first
  std::vector<double> rotation_degrees;                  ///< angle of R in F = R S
  std::vector<double> von_mises_stress;                  ///< sqrt(3/2) |2 mu dev(eps)|, mu the mean of the cell [MPa]
  std::vector<double> young_modulus, poisson_ratio;      ///< of the mean moduli over the filled part [MPa], [1]
  double min_jacobian = std::numeric_limits<double>::infinity();  ///< least det F
  std::size_t inverted_cells = 0;                                 ///< with det F <= 0
};

/// @param strain  eps = S - 1, or the symmetric part of F - 1 for Cauchy strain
CellMeasures measure_cells(const hexmesh::Lattice& lattice, int level, const Mesh& mesh, Strain strain,
                           const NodeVector& u);

}  // namespace hexsolver
