// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hexmesh/lattice/lattice.h"

namespace hexmesh {

/// One property that every lattice has, and how far this one is from it.
struct Finding {
  const char* property = "";
  int level = 0;
  double error = 0;  ///< relative, or a count where the limit is 0
  double limit = 0;

  bool holds() const { return error <= limit; }  // false for NaN
};

/// Checks a lattice against its own voxels and against mechanics:
///  - cells, labels, children and parts are those that its voxels and materials give;
///  - volume and mass of all cells are those of the voxels (1e-9);
///  - the energy of a linear displacement field is that of the filled volume, from K and from mean dilatation (1e-9 for
///    the body; 1e-12 for single cells);
///  - the six rigid motions take no force (1e-12), b . u of a linear field is V div u (1e-12);
///  - full cells of one material have the stiffness of one large cell (1e-12);
///  - lumped masses are >= 0 and add up to the mass (1e-12).
/// Single cells: of each level up to 2000 elements, evenly spread over all.
/// @pre all levels are there
std::vector<Finding> check_lattice(const Lattice& lattice);

}  // namespace hexmesh
