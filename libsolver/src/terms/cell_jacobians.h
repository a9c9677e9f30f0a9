// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "hexmesh/lattice/subcells.h"

namespace hexsolver {

/// det F of the trilinear field of a cell where its material is.
struct Jacobians {
  double least = 1;
  double mean = 1;        ///< the volume over that at rest
  double inside_out = 0;  ///< part of the material where it is <= 0
};

/// At the centres of the subcells with material.
/// @param now, rest  corners of the cell, relative to any points [mm]
/// @param where      not 0
Jacobians jacobians_in_subcells(const Eigen::Matrix<double, 3, 8>& now, const Eigen::Matrix<double, 3, 8>& rest,
                                hexmesh::SubcellMask where);

}  // namespace hexsolver
