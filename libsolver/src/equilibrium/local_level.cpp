// SPDX-License-Identifier: Apache-2.0
#include "equilibrium/local_level.h"

#include <algorithm>

#include "core/rotation.h"
#include "level/condition_reports.h"

namespace hexsolver {
namespace {

/// Of the cells of a level, those whose parents are rotated by more than an angle [rad].
/// @param merge  of the cells into those of the coarser level
std::vector<bool> cells_rotated_by(double angle, const ElasticCells& parents, const NodeVector& u,
                                   const hexmesh::Merge& merge, std::size_t num_cells) {
  std::vector<bool> rotating(num_cells);
  for (std::size_t parent = 0; parent < merge.children.size(); ++parent) {
    const Mat3 f = parents.mean_gradient(parent, u);
    const bool rotates = rotation_angle(polar_decomposition(f).rotation) > angle;
    for (const std::int32_t child : merge.children[parent])
      if (child >= 0) rotating[static_cast<std::size_t>(child)] = rotates;
  }
  return rotating;
}

}  // namespace

double LocalLevel::diameter() const {
  const Mesh& mesh = problem_.mesh();
  const Index3 extent = hexmesh::extent_of(mesh.cells());
  return (mesh.edges().cwiseAbs() * Vec3(extent[0], extent[1], extent[2])).norm();
}

RotatingCells LocalLevel::build(Elasticity elasticity, const CoarseStart<LocalLevel>* start, NodeVector& u) {
  if (!start) {
    problem_.build_potential(elasticity);
    return {};
  }
  const Mesh& mesh = problem_.mesh();
  const LevelProblem& coarser = start->level->problem();
  const hexmesh::Merge merge = merge_of(*start->level);
  std::vector<bool> rotating;
  RotatingCells num_rotating;
  if (start->rotating_above) {
    rotating = cells_rotated_by(*start->rotating_above, coarser.elastic(), *start->u, merge, mesh.num_cells());
    num_rotating = static_cast<std::size_t>(std::count(rotating.begin(), rotating.end(), true));
  }
  problem_.build_potential(elasticity, std::move(rotating));
  Prolongation(mesh, coarser.mesh(), merge).prolongate(*start->u, u);
  return num_rotating;
}

hexmesh::Merge LocalLevel::merge_of(const LocalLevel& coarser) const {
  return hexmesh::merge_cells(problem_.mesh().cells(),
                              lattice_.levels[static_cast<std::size_t>(coarser.level())].merge);
}

void LocalLevel::prolongate(const LocalLevel& coarser, const NodeVector& from, NodeVector& to) const {
  Prolongation(problem_.mesh(), coarser.problem().mesh(), merge_of(coarser)).prolongate(from, to);
}

double LocalLevel::mean_deformation(const NodeVector& u) const {
  RigidFit fit;
  problem_.elastic().add_to(fit, u);
  fit.solve();
  return problem_.elastic().deformation_in_material(u, fit);
}

LevelMeasures LocalLevel::measures(const NodeVector& u) {
  NodeVector gradient, magnitude;
  problem_.potential().move_to(u);
  problem_.potential().gradient(u, gradient, magnitude);
  return {problem_.elastic().energy(u), reactions(problem_.constraints(), problem_.scene(), gradient)};
}

NewtonOutcome LocalLevel::minimize(const NewtonOptions& options, NodeVector& u, const NewtonProgress& progress) {
  return hexsolver::minimize(problem_.hierarchy(), problem_.potential(), problem_.constraints(), options, u, progress);
}

ElasticCells::Size LocalLevel::size_in_material(const NodeVector& field, bool with_islands) const {
  return problem_.elastic().size_in_material(field, with_islands ? std::vector<bool>() : problem_.islands());
}

std::string LocalLevel::limit_reached(const NodeVector& u, bool nearly) const {
  return u.allFinite() ? problem_.elastic().limit_reached(u, nearly) : "";
}

std::optional<std::string> LocalLevel::obstacle_inside(const NodeVector& u) const {
  for (std::size_t c = 0; c < problem_.contacts().size(); ++c)
    if (problem_.contacts()[c]->state(u).is_inside) return problem_.scene().contacts[c].name;
  return {};
}

}  // namespace hexsolver
