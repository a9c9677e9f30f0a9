// SPDX-License-Identifier: Apache-2.0
#include "terms/make_elastic_cells.h"

#include "hexmesh/lattice/element_tree.h"
#include "terms/cauchy.h"
#include "terms/corotational.h"
#include "terms/edge_rotation.h"
#include "terms/hyperelastic.h"

namespace hexsolver {
namespace {

std::vector<std::vector<hexmesh::MaterialPoint>> form_quadratures(const hexmesh::Lattice& lattice, int level) {
  std::vector<std::vector<hexmesh::MaterialPoint>> out(lattice.levels[level].filled.size());
#pragma omp parallel
  {
    hexmesh::QuadratureTree tree(lattice);
#pragma omp for schedule(dynamic, 64)
    for (std::size_t e = 0; e < out.size(); ++e) out[e] = tree.form(level, static_cast<std::int32_t>(e));
  }
  return out;
}

template <class Model>
std::vector<ElementModel> make_models(const std::vector<hexmesh::SubcellMask>& subcells, const Model& model) {
  std::vector<ElementModel> models(subcells.size());
#pragma omp parallel for schedule(static)
  for (std::size_t e = 0; e < models.size(); ++e) {
    models[e] = model(e);
    models[e].subcells = subcells[e];
  }
  return models;
}

/// The models of the elements of a level; `elements` stays empty where the lattice has their matrices and these do.
std::vector<ElementModel> make_models(const hexmesh::Lattice& lattice, int level, const ElasticSettings& settings,
                                      std::vector<hexmesh::Element>& elements) {
  const Mat3 edges = lattice.cell_edges(level);
  const hexmesh::StoredMatrices& stored = lattice.level(level).matrices;
  const std::vector<hexmesh::SubcellMask>& subcells = lattice.level(level).subcells;
  if (!stored.empty() && !needs_elements(settings.elasticity, settings.stiffness))
    return make_models(subcells,
                       [&](std::size_t e) { return make_element_model(stored, e, edges, settings.volumetric); });
  elements = hexmesh::form_elements(lattice, level);
  if (settings.stiffness == Stiffness::uniform)
    for (hexmesh::Element& e : elements) e = hexmesh::spread_evenly(e);
  const hexmesh::ElementMatrices matrices(edges);
  return make_models(subcells,
                     [&](std::size_t e) { return make_element_model(matrices, elements[e], settings.volumetric); });
}

}  // namespace

std::unique_ptr<ElasticCells> make_elastic_cells(const Mesh& mesh, const hexmesh::Lattice& lattice, int level,
                                                 const ElasticSettings& settings) {
  std::vector<hexmesh::Element> elements;
  std::vector<ElementModel> models = make_models(lattice, level, settings, elements);
  std::vector<std::int32_t> element = lattice.levels[level].element;

  if (settings.elasticity == Elasticity::cauchy)
    return std::make_unique<CauchyCells>(mesh, std::move(element), std::move(models));
  if (settings.elasticity == Elasticity::corotational && settings.rotation == Rotation::edges)
    return std::make_unique<EdgeRotatedCells>(mesh, std::move(element), std::move(models));
  if (settings.elasticity == Elasticity::corotational)
    return std::make_unique<CorotationalCells>(mesh, std::move(element), std::move(models), settings.rotating,
                                               settings.saves_memory);
  std::vector<std::vector<hexmesh::MaterialPoint>> points;
  if (settings.stiffness == Stiffness::uniform)
    for (const hexmesh::Element& e : elements)
      points.push_back(hexmesh::gauss_points(e.volume(), e.total_shear(), e.total_bulk()));
  else
    points = form_quadratures(lattice, level);
  return std::make_unique<HyperelasticCells>(mesh, std::move(element), std::move(models), points, settings.elasticity,
                                             settings.volumetric);
}

}  // namespace hexsolver
