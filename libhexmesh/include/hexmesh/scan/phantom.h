// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "hexmesh/volume/intensity_volume.h"
#include "hexmesh/volume/label_volume.h"

namespace hexmesh {

/// A made-up scan with its segmentation.
struct Phantom {
  LabelVolume labels;
  IntensityVolume intensity;  ///< CT-like, in Hounsfield units, on the same grid
};

/// A smooth liver-like organ of about 200 x 100 x 100 mm (left-right, front-back, foot-head) in a torso-like
/// surrounding: 1 = liver, 2 = tumour (a ball of 26 mm), 3 = vessel (a trunk with two branches). The same for every
/// call.
/// @param spacing  edge of the cubic voxels [mm], in [0.25, 10]
/// @throws Error{usage} outside that range
Phantom liver_phantom(double spacing);

/// A simple solid for studies of size and placement.
struct SolidPhantom {
  std::string name = "beam";           ///< of solid_phantoms()
  double spacing = 2;                  ///< edge of the cubic voxels [mm]
  Vec3 rotation = Vec3::Zero();        ///< about x, then y, then z through the solid's centre [degrees]
  Vec3 shift = Vec3::Zero();           ///< against the voxels [mm]
  std::map<std::string, double> size;  ///< [mm] by name; what is not given has its default
};

/// Names of the solids with the names and defaults of their sizes [mm].
const std::map<std::string, std::map<std::string, double>>& solid_phantoms();

/// Voxels whose centres lie in the solid. Its centre is at the origin; unrotated and unshifted, its lower corner is a
/// voxel's corner: the best position for boxes of whole voxels.
/// @throws Error{usage} for an unknown name or size, or a size that is not > 0
LabelVolume solid_phantom(const SolidPhantom& solid);

}  // namespace hexmesh
