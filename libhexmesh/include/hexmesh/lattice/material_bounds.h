// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hexmesh {

/// Bounds of Poisson's ratio: closer to -1 and 0.5 the moduli of shape and volume differ by more than a solution in
/// double precision can tell.
inline constexpr double least_poisson = -0.999999, most_poisson = 0.499999;

}  // namespace hexmesh
