// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>

#include "hexmesh/result/result.h"
#include "hexmesh/volume/intensity_volume.h"

namespace hexmesh {

/// Grey values from black to white.
struct GreyWindow {
  double black = 0, white = 1;

  /// 0 for black to 1 for white.
  double brightness(double value) const { return std::clamp((value - black) / (white - black), 0.0, 1.0); }
};

/// The window that is asked for; what is not: such that all of the body's values are told apart in the middle third.
/// @param level, window  its middle and its width, in the scan's unit
GreyWindow grey_window(const Result& result, const IntensityVolume& scan, std::optional<double> level,
                       std::optional<double> window);

}  // namespace hexmesh
