// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include "cli/tool.h"
#include "hexmesh/lattice/lattice.h"
#include "hexsolver/scene.h"

namespace hextools {

/// How fast the elements of all levels follow from the voxels, on one core.
nlohmann::json bench_lattice(const hexmesh::Lattice& lattice, int repeats);

/// What a V-cycle and its set-up cost in operator products.
nlohmann::json bench_solver(const hexmesh::Lattice& lattice, const hexsolver::Scene& scene, int level, int repeats);

/// What each effect of a scene costs and changes.
nlohmann::json bench_effects(const hexmesh::Lattice& lattice, const hexsolver::Scene& whole, int level, int repeats,
                             const Console& console);

}  // namespace hextools
