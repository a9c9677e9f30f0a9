// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "hexmesh/lattice/lattice.h"
#include "hexsolver/scene/law.h"
#include "terms/elastic.h"

namespace hexsolver {

/// What decides how cells store energy.
struct ElasticSettings {
  Elasticity elasticity = Elasticity::corotational;
  Rotation rotation = Rotation::polar;
  Volumetric volumetric = Volumetric::mean;
  Stiffness stiffness = Stiffness::exact;
  std::vector<bool> rotating;  ///< which co-rotational cells rotate; empty = all
  bool saves_memory = false;   ///< co-rotational cells keep frames in single precision only
};

/// The elastic energy of a level of a lattice.
/// @param mesh  of that level; must outlive what is returned
std::unique_ptr<ElasticCells> make_elastic_cells(const Mesh& mesh, const hexmesh::Lattice& lattice, int level,
                                                 const ElasticSettings& settings);

}  // namespace hexsolver
