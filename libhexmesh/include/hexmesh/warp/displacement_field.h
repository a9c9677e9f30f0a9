// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "hexmesh/result/result.h"

namespace hexmesh {

/// A displacement at each voxel centre of a grid [mm], LPS; NaN where it is not known.
struct DisplacementField {
  Grid grid;
  std::vector<Eigen::Vector3f> values;  ///< shape (grid.num_voxels()), i fastest

  /// Trilinear between voxel centres as resampling filters do it, 0 beyond the outermost ones.
  Vec3 at(const Vec3& position) const;
};

/// From the deformed body to the body at rest: at x, X - x for the material X that is there now, by inverting the
/// trilinear map of the deformed cell that holds x. Where the body overlaps itself one of the two is taken.
/// @param reach  how far outside the material the nearest cell's map is continued, in voxels; 0 = material only
DisplacementField displacement_to_rest(const Result& result, const Grid& grid, double reach = 0);

/// From the body at rest to the deformed body: at X, u(X) = H u(q), continued likewise.
DisplacementField displacement_from_rest(const Result& result, const Grid& grid, double reach = 0);

/// Fill what is not known: solves Laplace's equation between what is known and zero just outside the grid (to a few
/// per cent, by a cascade of grids from coarse to fine with some sweeps of over-relaxation on each).
void continue_to_border(DisplacementField& field);

}  // namespace hexmesh
