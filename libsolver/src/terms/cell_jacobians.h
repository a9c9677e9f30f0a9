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
/// @param corners  of the moved cell, relative to any point [mm]
/// @param rest     determinant of its edges at rest [mm^3]
/// @param where    not 0
Jacobians jacobians_in_subcells(const Eigen::Matrix<double, 3, 8>& corners, double rest, hexmesh::SubcellMask where);

}  // namespace hexsolver
