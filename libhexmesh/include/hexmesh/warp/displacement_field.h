// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
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

/// The same on some layers of a grid.
struct FieldSlab {
  Index3 first, extent;                 ///< in the grid
  std::vector<Eigen::Vector3f> values;  ///< shape (extent), i fastest
};

/// f(index in the grid, value) of each sample.
template <class F>
void for_each_sample(const FieldSlab& slab, F&& f) {
  const Eigen::Vector3f* value = slab.values.data();
  Index3 v;
  for (v[2] = slab.first[2]; v[2] < slab.first[2] + slab.extent[2]; ++v[2])
    for (v[1] = slab.first[1]; v[1] < slab.first[1] + slab.extent[1]; ++v[1])
      for (v[0] = slab.first[0]; v[0] < slab.first[0] + slab.extent[0]; ++v[0]) f(v, *value++);
}

/// Calls f with the slabs of displacement_to_rest(result, grid, reach), several at once, so that it never is in memory
/// as a whole.
void for_each_slab_to_rest(const Result& result, const Grid& grid, double reach,
                           const std::function<void(const FieldSlab&)>& f);

/// From the body at rest to the deformed body: at X, u(X) = H u(q), continued likewise.
DisplacementField displacement_from_rest(const Result& result, const Grid& grid, double reach = 0);

/// Fill what is not known: solves Laplace's equation between what is known and zero just outside the grid (to a few
/// per cent, by a cascade of grids from coarse to fine with some sweeps of over-relaxation on each).
void continue_to_border(DisplacementField& field);

}  // namespace hexmesh
