// SPDX-License-Identifier: Apache-2.0
#include "terms/make_elastic_cells.h"

#include <map>

#include "hexmesh/lattice/element_tree.h"
#include "terms/cauchy.h"
#include "terms/corotational.h"
#include "terms/edge_rotation.h"
#include "terms/hyperelastic.h"

namespace hexsolver {
namespace {

using OfLevel = MeshCells::OfLevel;

std::size_t num_elements(const hexmesh::Lattice& lattice, const OfLevel& of) {
  return of.element.empty() ? lattice.level(of.level).filled.size() : of.element.size();
}

std::int32_t number_in_level(const OfLevel& of, std::ptrdiff_t e) {
  return of.element.empty() ? static_cast<std::int32_t>(e) : of.element[static_cast<std::size_t>(e)];
}

/// Whether the law integrates at points.
bool needs_points(const ElasticSettings& settings) {
  return is_hyperelastic(settings.elasticity) ||
         (settings.is_reshaped && settings.elasticity == Elasticity::corotational);
}

void add_quadratures(const hexmesh::Lattice& lattice, const OfLevel& of, std::vector<CellPoints>& points) {
  const auto count = static_cast<std::ptrdiff_t>(num_elements(lattice, of));
  const Mat3 edges = lattice.cell_edges(of.level);
#pragma omp parallel
  {
    hexmesh::QuadratureTree tree(lattice);
#pragma omp for schedule(dynamic, 64)
    for (std::ptrdiff_t e = 0; e < count; ++e)
      points[of.first_element + static_cast<std::size_t>(e)] =
          make_cell_points(tree.form(of.level, number_in_level(of, e)), edges);
  }
}

/// The models of the elements of a level, from the matrices that the lattice has where these do.
/// @param points  also of each element where the law integrates at them
void add_models(const hexmesh::Lattice& lattice, const OfLevel& of, const ElasticSettings& settings,
                std::vector<ElementModel>& models, std::vector<CellPoints>& points) {
  const Mat3 edges = lattice.cell_edges(of.level);
  const hexmesh::StoredMatrices& stored = lattice.level(of.level).matrices;
  const std::vector<hexmesh::SubcellMask>& subcells = lattice.level(of.level).subcells;
  const bool is_even = settings.stiffness == Stiffness::uniform;
  const auto add = [&](const auto& model_of) {
    const auto count = static_cast<std::ptrdiff_t>(num_elements(lattice, of));
#pragma omp parallel for schedule(static)
    for (std::ptrdiff_t e = 0; e < count; ++e) {
      const std::size_t element = hexmesh::as_size(number_in_level(of, e));
      ElementModel& model = models[of.first_element + static_cast<std::size_t>(e)];
      model = model_of(static_cast<std::size_t>(e), element);
      model.subcells = subcells[element];
    }
  };
  if (!stored.empty() && !needs_elements(settings.elasticity, settings.stiffness, settings.is_reshaped)) {
    add([&](std::size_t, std::size_t element) {
      return make_element_model(stored, element, edges, settings.volumetric);
    });
    return;
  }
  std::vector<hexmesh::Element> elements = form_elements(lattice, of);
  if (is_even)
    for (hexmesh::Element& e : elements) e = hexmesh::spread_evenly(e);
  const hexmesh::ElementMatrices matrices(edges);
  const bool bends = settings.stiffness == Stiffness::incompatible && of.level > 0 && points.empty();
  add([&](std::size_t e, std::size_t) {
    return make_element_model(matrices, elements[e], edges, settings.volumetric, bends);
  });
  if (points.empty()) return;
  if (is_even)
    for (std::size_t e = 0; e < elements.size(); ++e)
      points[of.first_element + e] = make_cell_points(
          hexmesh::gauss_points(elements[e].volume(), elements[e].total_shear(), elements[e].total_bulk()), edges);
  else
    add_quadratures(lattice, of, points);
}

/// The models of condensed cells, each kind one.
/// @param models   of the elements
/// @param element  of each cell, what it is of
void take_condensed(const MeshCells& cells, const std::vector<hexmesh::CondensedLevel>& condensed_levels,
                    std::vector<ElementModel>& models, std::vector<std::int32_t>& element) {
  if (condensed_levels.empty()) return;
  std::vector<ElementModel> out;
  std::size_t kinds = models.size();
  for (const hexmesh::CondensedLevel& level : condensed_levels) kinds += level.condensed.size();
  out.reserve(kinds);
  std::size_t c = 0;
  auto from = condensed_levels.begin();
  for (const OfLevel& of : cells.levels()) {
    const std::size_t end = c + (of.cells.empty() ? cells.lattice().level(of.level).cells.size() : of.cells.size());
    const Mat3 edges = cells.lattice().cell_edges(of.level);
    std::map<std::int32_t, std::int32_t> number;  // of a kind, or of an element at level 0, in `out`
    for (; c < end; ++c) {
      const std::int32_t in_level = cells.place(c).cell;
      const std::int32_t kind = of.level == 0 ? element[c] : from->kind[hexmesh::as_size(in_level)];
      const auto [entry, is_new] = number.try_emplace(kind, static_cast<std::int32_t>(out.size()));
      if (is_new) {
        const ElementModel& model = models[hexmesh::as_size(element[c])];
        out.push_back(of.level == 0 ? model : condensed(model, from->condensed[hexmesh::as_size(kind)], edges));
      }
      element[c] = entry->second;
    }
    if (of.level > 0) ++from;
  }
  models = std::move(out);
}

}  // namespace

ElasticSettings elastic_settings(const Scene& scene, Elasticity elasticity, std::vector<bool> rotating,
                                 std::vector<hexmesh::CondensedLevel> condensed) {
  return {elasticity,          scene.rotation,      scene.volumetric,     scene.stiffness_of_cells(),
          std::move(rotating), scene.is_reshaped(), std::move(condensed), scene.saves_memory};
}

std::vector<hexmesh::CondensedLevel> condense(const MeshCells& cells, const Scene& scene,
                                              const std::vector<Acting>& acting,
                                              std::optional<hexmesh::Condensation>& known) {
  if (scene.stiffness_of_cells() != Stiffness::condensed) return {};
  std::vector<int> levels;
  for (const OfLevel& of : cells.levels())
    if (of.level > 0) levels.push_back(of.level);
  if (levels.empty()) return {};
  const hexmesh::Lattice& lattice = cells.lattice();
  std::vector<hexmesh::ActingPoint> points = acting_points(lattice.level(0).cells, acting);
  const auto dilatation =
      scene.volumetric == Volumetric::mean ? hexmesh::CondensedDilatation::mean : hexmesh::CondensedDilatation::full;
  if (!known || !known->is_of(lattice, points, dilatation)) known.emplace(lattice, std::move(points), dilatation);
  std::vector<hexmesh::CondensedLevel> out;
  if (!cells.is_graded()) {
    out.push_back(known->take(levels.front()));
    return out;
  }
  for (const int level : levels) out.push_back(known->level(level));
  return out;
}

std::unique_ptr<ElasticCells> make_elastic_cells(const Mesh& mesh, const MeshCells& cells,
                                                 const ElasticSettings& settings) {
  std::vector<ElementModel> models(cells.num_elements());
  std::vector<CellPoints> points(needs_points(settings) ? models.size() : 0);
  for (const OfLevel& of : cells.levels()) add_models(cells.lattice(), of, settings, models, points);
  std::vector<std::int32_t> element = cells.elements();
  take_condensed(cells, settings.condensed, models, element);

  if (settings.elasticity == Elasticity::cauchy)
    return std::make_unique<CauchyCells>(mesh, std::move(element), std::move(models));
  if (settings.elasticity == Elasticity::corotational && settings.rotation == Rotation::edges)
    return std::make_unique<EdgeRotatedCells>(mesh, std::move(element), std::move(models));
  if (settings.elasticity == Elasticity::corotational)
    return std::make_unique<CorotationalCells>(mesh, std::move(element), std::move(models), settings.rotating,
                                               settings.saves_memory, std::move(points));
  return std::make_unique<HyperelasticCells>(mesh, std::move(element), std::move(models), std::move(points),
                                             settings.elasticity, settings.volumetric);
}

}  // namespace hexsolver
