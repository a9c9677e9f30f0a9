// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hexmesh/warp/displacement_field.h"

namespace hexmesh {

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

/// What is to be told of a warp by its check: how good it is, and what warns of its use.
struct WarpNotices {
  std::string note;  ///< empty where a warning says it
  std::vector<std::string> warnings;
};

/// @throws Error{geometry} where the two directions cannot hold the deformation
WarpNotices notices_of(const Result& result, const Warp& warp, const WarpCheck& check);

/// Whether the deformed body stays on the voxels that it is to be written on: a warning where some of it does not;
/// empty: it does.
/// @pre the result has its surface
/// @throws Error{input} where the grid holds no part of the body
std::string warning_of_grid(const Result& result, const Grid& grid);

}  // namespace hexmesh
