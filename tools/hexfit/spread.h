// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cli/tool.h"
#include "hexmesh/lattice/lattice.h"
#include "hexsolver/equilibrium/equilibrium.h"
#include "hexsolver/scene/scene.h"

namespace hextools {

/// By how much a fit changes with something that was assumed [mm].
struct Spread {
  std::string of;
  double mean_mm = 0;     ///< over the material
  double largest_mm = 0;  ///< of the surface
};

/// Solves again from the fit with another Poisson's ratio, and with stiffnesses of segments farther apart where they
/// differ.
/// @param file  of the lattice
std::vector<Spread> find_spread(const hexmesh::Lattice& lattice, const std::filesystem::path& file,
                                const hexsolver::Scene& scene, const hexsolver::Outcome& fit, const Console& console);

}  // namespace hextools
