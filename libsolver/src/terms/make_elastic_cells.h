// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "hexsolver/scene/scene.h"
#include "mesh/mesh_cells.h"
#include "selection/selection.h"
#include "terms/elastic.h"

namespace hexsolver {

/// What decides how cells store energy.
struct ElasticSettings {
  Elasticity elasticity = Elasticity::corotational;
  Rotation rotation = Rotation::polar;
  Volumetric volumetric = Volumetric::mean;
  Stiffness stiffness = Stiffness::exact;
  std::vector<bool> rotating;                      ///< which co-rotational cells rotate; empty = all
  bool is_reshaped = false;                        ///< cells may come to rest elsewhere, see ElasticCells::set_rest()
  std::vector<hexmesh::CondensedLevel> condensed;  ///< of each level above 0, for condensed cells
  bool saves_memory = false;                       ///< co-rotational cells keep frames in single precision only
};

/// Those of a scene.
/// @param elasticity  of its cells, where it finds their strain
ElasticSettings elastic_settings(const Scene& scene, Elasticity elasticity, std::vector<bool> rotating,
                                 std::vector<hexmesh::CondensedLevel> condensed);

/// What a scene's condensed cells come to, of each level above 0; nothing where its cells are others.
/// @param acting  what acts on them
/// @param known   of other cells of the lattice, which this makes and adds to; it keeps what finer ones take
std::vector<hexmesh::CondensedLevel> condense(const MeshCells& cells, const Scene& scene,
                                              const std::vector<Acting>& acting,
                                              std::optional<hexmesh::Condensation>& known);

/// The elastic energy of cells of a lattice.
/// @param mesh  of these cells; must outlive what is returned
std::unique_ptr<ElasticCells> make_elastic_cells(const Mesh& mesh, const MeshCells& cells,
                                                 const ElasticSettings& settings);

}  // namespace hexsolver
