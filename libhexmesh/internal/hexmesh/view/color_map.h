// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/view/canvas.h"

namespace hexmesh {

/// Matplotlib's viridis (perceptually uniform, readable in grey and by the colour-blind) at t, clamped to [0, 1].
/// Source: S. van der Walt, N. Smith, matplotlib 1.5, CC0; nine of its values, linear between them.
Rgb viridis(double t);

}  // namespace hexmesh
