// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/scan/label_volume.h"

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

}  // namespace hexmesh
