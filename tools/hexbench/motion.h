// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include "cli/tool.h"
#include "hexmesh/lattice/lattice.h"
#include "hexsolver/scene/scene.h"

namespace hextools {

/// Steps per second of a motion on every level, with and without surfaces that follow: the paper's Fig. 14 and Table 3.
/// @pre the lattice has points on its surface
nlohmann::json bench_motion_levels(const hexmesh::Lattice& lattice, const hexsolver::Scene& scene,
                                   const Console& console);

}  // namespace hextools
