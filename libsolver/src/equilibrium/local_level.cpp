// SPDX-License-Identifier: Apache-2.0
#include "equilibrium/local_level.h"

#include <algorithm>

#include "level/condition_reports.h"
#include "newton/level_equations.h"
#include "terms/turns.h"

namespace hexsolver {
namespace {

const char* larger_stiffness(const Contact& contact) {
  return contact.stiffness > 0 ? "; a larger stiffness_n_mm holds it off" : "";
}

/// Of the cells of a level, those whose parents are rotated by more than an angle [rad].
/// @param parent_of  cell -> that of the coarser level
std::vector<bool> cells_rotated_by(double angle, const ElasticCells& parents, const NodeVector& u,
                                   const std::vector<std::int32_t>& parent_of) {
  const std::vector<double> turns = turns_of(parents, u);
  std::vector<bool> rotating;
  for (const std::int32_t parent : parent_of) rotating.push_back(turns[hexmesh::as_size(parent)] > angle);
  return rotating;
}

}  // namespace

RotatingCells LocalLevel::build(Elasticity elasticity, const CoarseStart<LocalLevel>* start, NodeVector& u) {
  if (!start) {
    problem_.build_potential(elasticity);
    return {};
  }
  const Mesh& mesh = problem_.mesh();
  const LevelProblem& coarser = start->level->problem();
  const std::vector<std::int32_t> parents = parents_in(*start->level);
  std::vector<bool> rotating;
  RotatingCells num_rotating;
  if (start->rotating_above) {
    rotating = cells_rotated_by(*start->rotating_above, coarser.elastic(), *start->u, parents);
    num_rotating = static_cast<std::size_t>(std::count(rotating.begin(), rotating.end(), true));
  }
  problem_.build_potential(elasticity, std::move(rotating));
  Prolongation(mesh, coarser.mesh(), parents, ratio_to(*start->level)).prolongate(*start->u, u);
  return num_rotating;
}

Index3 LocalLevel::ratio_to(const LocalLevel& coarser) const {
  return hexmesh::coarser_index(coarser.problem().cells().unit(), problem_.cells().unit());
}

std::vector<std::int32_t> LocalLevel::parents_in(const LocalLevel& coarser) const {
  return holders(problem_.cells(), coarser.problem().cells());
}

void LocalLevel::prolongate(const LocalLevel& coarser, const NodeVector& from, NodeVector& to) const {
  Prolongation(problem_.mesh(), coarser.problem().mesh(), parents_in(coarser), ratio_to(coarser)).prolongate(from, to);
}

double LocalLevel::mean_deformation(const NodeVector& u) const {
  RigidFit fit;
  problem_.elastic().add_to(fit, u);
  fit.solve();
  return problem_.elastic().deformation_in_material(u, fit);
}

double LocalLevel::share_of_turns(double angle, const NodeVector& u) const {
  return squares_of_turns(problem_.elastic(), u, angle).share();
}

LevelMeasures LocalLevel::measures(const NodeVector& u) {
  NodeVector gradient, magnitude;
  problem_.potential().move_to(u);
  problem_.potential().gradient(u, gradient, magnitude);
  return {problem_.strain_energy(u), reactions(problem_.constraints(), problem_.scene(), u, gradient)};
}

NewtonOutcome LocalLevel::minimize(const NewtonOptions& options, NodeVector& u, const NewtonProgress& progress) {
  LevelEquations equations(problem_.hierarchy(), problem_.potential(), problem_.constraints());
  double loads = 0;
  if (options.part_of_way > 0)
    for (const LevelProblem::LoadTotal& load : problem_.loads(u)) loads = std::max(loads, load.total.norm());
  equations.set_measures([this](const NodeVector& field) { return size_in_material(field, false).mean; }, loads);
  return minimize_on(equations, options, u, progress);
}

ElasticCells::Size LocalLevel::size_in_material(const NodeVector& field, bool with_islands) const {
  return problem_.elastic().size_in_material(field, with_islands ? std::vector<bool>() : problem_.islands());
}

/// Forces of obstacles follow from the solution, which is to be sharp; what they carry comes to rest slowly.
RoundLimits LocalLevel::round_limits(Aim aim) const {
  if (!problem_.matches().empty()) return {};
  constexpr double first_tolerance = 1e-4;
  if (problem_.is_carried() && aim == Aim::result) return {1e-6, first_tolerance, 200};
  // What friction did in a load step stays.
  if (problem_.is_carried() && has_friction(problem_.scene())) return {1e-5, first_tolerance, 200};
  return {1e-3, first_tolerance, 40};
}

std::string LocalLevel::limit_reached(const NodeVector& u, bool nearly) const {
  return u.allFinite() ? problem_.elastic().limit_reached(u, nearly) : "";
}

std::optional<std::string> LocalLevel::gone_through(const NodeVector& u) const {
  for (std::size_t c = 0; c < problem_.contacts().size(); ++c) {
    const Contact& contact = problem_.scene().contacts[c];
    if (problem_.contacts()[c]->passes_through(problem_.potential().at_all(u)))
      return fmt::format("a part of the body went through another, or deep into it, of contact '{}'{}", contact.name,
                         larger_stiffness(contact));
  }
  return through_obstacle(u);
}

std::optional<std::string> LocalLevel::through_obstacle(const NodeVector& u) const {
  for (std::size_t c = 0; c < problem_.contacts().size(); ++c) {
    const Contact& contact = problem_.scene().contacts[c];
    if (problem_.contacts()[c]->went_through(u))
      return fmt::format("the obstacle of contact '{}' went through the surface{}", contact.name,
                         larger_stiffness(contact));
  }
  return {};
}

std::optional<std::string> LocalLevel::why_no_solution(const NodeVector& u) const {
  if (auto through = through_obstacle(u)) return through;
  return why_missed(problem_.matches(), u);
}

}  // namespace hexsolver
