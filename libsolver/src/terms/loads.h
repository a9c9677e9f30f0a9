// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "selection/selection.h"
#include "terms/elastic.h"
#include "terms/load.h"

namespace hexsolver {

/// Each [[force]] of the scene, then [gravity] if there is any, on the nodes of one level: f(q) = H^T f(p), dead or
/// with the surface, and row sums of the mass matrix times gravity.
/// @throws Error as Selector::select
std::vector<std::unique_ptr<Load>> make_loads(const Scene& scene, const MeshCells& cells, const Mesh& mesh,
                                              Selector& selector);

/// The weight of cells whose models are there: of condensed ones what their voxels hand to the corners.
std::unique_ptr<Load> make_weight(const Vec3& gravity, const MeshCells& cells, const ElasticCells& elastic);

}  // namespace hexsolver
