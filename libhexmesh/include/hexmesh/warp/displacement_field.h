// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "hexmesh/file/result_file.h"
#include "hexmesh/scan/label_volume.h"

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

/// Both directions of a deformation everywhere. Inside the body they are the solution; outside nothing was simulated,
/// and they fade smoothly to zero at the border of their grid.
struct Warp {
  DisplacementField to_rest;    ///< deformed -> rest: what a resampling filter expects
  DisplacementField from_rest;  ///< rest -> deformed: what moves points
};

/// The grid of a warp: the lattice's voxels, continued by whole voxels around the body at rest and deformed, and once
/// and a half the largest displacement beyond (half the body at most), for the fading. Where a body moves farther than
/// it is thick, no fading can but fold. Voxels of the finest axes are taken together while there are more than 24
/// million.
Grid warp_grid(const Result& result);

/// The lattice's voxels, continued by whole voxels to hold the body at rest and deformed.
/// @throws Error{geometry} where that takes more than 2e9 voxels
Grid fitted_grid(const Result& result);

Warp make_warp(const Result& result);

/// How well the two directions undo each other at the voxel centres of the body, in voxels.
struct WarpCheck {
  std::size_t voxels = 0, over_a_tenth = 0;
  double mean = 0, largest = 0;
  double ghost_ml = 0;  ///< outside the body, but led into it: what a resampling filter shows a second time [mL]
};
WarpCheck check_warp(const Result& result, const Warp& warp);

/// The scan as it looks now: each voxel of `grid` takes the value at its rest position, in the body exactly, around it
/// by the warp; the scan's lowest outside the scan and where the body would be seen a second time.
IntensityVolume deform(const Result& result, const IntensityVolume& scan, const DisplacementField& to_rest,
                       const Grid& grid);

/// The segmentation of a result as it is now: each voxel of `grid` takes the label at its rest position, likewise.
LabelVolume deformed_labels(const Result& result, const DisplacementField& to_rest, const Grid& grid);

/// Box of the body's voxels at rest and deformed together [mm], LPS.
struct Bounds {
  Vec3 low, high;
};
Bounds bounds_of(const Result& result);

}  // namespace hexmesh
