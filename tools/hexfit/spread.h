// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "cli/tool.h"
#include "hexmesh/lattice/lattice.h"
#include "hexsolver/scene/scene.h"

namespace hextools {

/// By how much a fit changes with something that was assumed [mm].
struct Spread {
  std::string of;
  double mean_mm = 0;     ///< over the material
  double largest_mm = 0;  ///< of the surface
};

/// Solves again with other Poisson's ratios, with stiffnesses of segments farther apart where there are several, and
/// with another trust, on a level coarser by one, where that has cells enough.
/// @param level  of the fit
std::vector<Spread> find_spread(const hexmesh::Lattice& lattice, const hexsolver::Scene& scene, int level,
                                const Console& console);

}  // namespace hextools
