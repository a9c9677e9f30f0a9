// SPDX-License-Identifier: Apache-2.0
#include "terms/loads.h"

#include "terms/dead_load.h"
#include "terms/follower_pressure.h"
#include "terms/inertia.h"
#include "terms/point_hessians.h"

namespace hexsolver {
namespace {

/// Sums what comes to each node.
class NodeForces {
public:
  explicit NodeForces(const Mesh& mesh) : mesh_(mesh), sum_(NodeVector::Zero(mesh.num_dofs())) {}

  void add(std::size_t cell, const CellVector& forces) {
    for (std::size_t a = 0; a < 8; ++a)
      mesh_.for_each_free(cell, a, [&](std::int32_t n, double weight) {
        sum_.segment<3>(3 * Eigen::Index{n}) += weight * forces.segment<3>(3 * static_cast<Eigen::Index>(a));
      });
  }
  void add(std::size_t cell, const NodeWeights& weights, const Vec3& force) {
    add(cell, spread_to_nodes(weights, force));
  }

  std::vector<DeadLoad::NodeForce> nonzero() const {
    std::vector<DeadLoad::NodeForce> out;
    for (std::size_t n = 0; n < mesh_.num_nodes(); ++n)
      if (const Vec3 f = sum_.segment<3>(3 * n); f != Vec3::Zero()) out.push_back({static_cast<std::int32_t>(n), f});
    return out;
  }

private:
  const Mesh& mesh_;
  NodeVector sum_;
};

std::unique_ptr<Load> surface_force(const Force& force, const Mesh& mesh, Selector& selector) {
  const std::string what = with_place("force", force);
  const std::vector<SurfacePoint> points = selector.select(force.selection, what);
  if (force.follows)
    return std::make_unique<FollowerPressure>(load_name(force), mesh, points, selector, force.pressure,
                                              selector.rim(force.selection, what).empty());
  const bool by_area = force.selection.on == SurfacePoints::faces;
  double whole = 0;
  for (const SurfacePoint& p : points) whole += by_area ? p.area.norm() : 1;
  whole = selector.share().sum(whole);
  // A force that changes with time is the factor of a unit force along each axis.
  const Vec3 total = force.history && force.pressure == 0 ? Vec3::Ones() : force.total;
  NodeForces forces(mesh);
  for (const SurfacePoint& p : points)
    forces.add(p.cell, p.weights, (by_area ? p.area.norm() : 1) / whole * total - force.pressure * p.area);
  return std::make_unique<DeadLoad>(EffectKind::force, load_name(force), forces.nonzero());
}

/// @param elastic  null: no cell is condensed
std::unique_ptr<DeadLoad> weight(const Vec3& gravity, const MeshCells& cells, const Mesh& mesh,
                                 const ElasticCells* elastic = nullptr) {
  const std::vector<NodeWeights> masses = lumped_masses(cells);
  const std::vector<std::int32_t> element = cells.elements();
  NodeForces forces(mesh);
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    if (elastic && elastic->model(c).condensed)
      forces.add(c, elastic->model(c).condensed->weight * gravity);
    else
      forces.add(c, masses[element[c]], gravity);
  return std::make_unique<DeadLoad>(EffectKind::gravity, "gravity", forces.nonzero());
}

}  // namespace

std::unique_ptr<Load> make_weight(const Vec3& gravity, const MeshCells& cells, const ElasticCells& elastic) {
  return weight(gravity, cells, elastic.mesh(), &elastic);
}

std::vector<std::unique_ptr<Load>> make_loads(const Scene& scene, const MeshCells& cells, const Mesh& mesh,
                                              Selector& selector) {
  std::vector<std::unique_ptr<Load>> loads;
  for (const Force& force : scene.forces) loads.push_back(surface_force(force, mesh, selector));
  if (scene.gravity != Vec3::Zero()) loads.push_back(weight(scene.gravity, cells, mesh));
  return loads;
}

}  // namespace hexsolver
