// SPDX-License-Identifier: Apache-2.0
#include "level/level_problem.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "constraints/select_points.h"
#include "constraints/supports.h"
#include "level/grading.h"
#include "level/islands.h"
#include "selection/selection.h"
#include "terms/cell_measures.h"
#include "terms/loads.h"
#include "terms/make_elastic_cells.h"
#include "terms/prestress.h"

namespace hexsolver {
namespace {

using hexmesh::Lattice;

/// Stiffness of the springs that hold islands, over the mean diagonal of their cells': they touch nothing else.
constexpr double island_spring = 1;

/// In a round what nothing but obstacles holds moves by this part of the body's size where none stops it; and its
/// springs beside the body's stiffness, so that the equations have a solution.
constexpr double round_of_size = 0.3, least_carrying = 2e-3;

/// Beyond this single precision loses what is soft beside what is stiff: an inclusion 1e4 times stiffer took 346
/// iterations in few cells that share both, 234 in double precision; 1e6 times stiffer it had no end, and 68.
constexpr double most_contrast_in_single = 1e3;

/// A hand moves the body by little in a step, and its springs are so much stiffer than the body that the points follow
/// it to a few per cent.
constexpr double hand_step_of_size = 0.02, hand_over_young = 100;

/// A body is pulled softly first: what it is to lie on is found better from near.
constexpr double match_load_step = 1.0 / 4;

Progress at_the_end(const Scene& scene) { return {1, scene.dynamics ? scene.dynamics->duration : 0}; }

NodeVector at_all_nodes(const Mesh& mesh, const NodeVector& u) {
  NodeVector all;
  mesh.spread(u, all);
  return all;
}

}  // namespace

bool is_of_high_contrast(const Lattice& lattice) {
  double softest = std::numeric_limits<double>::infinity(), stiffest = 0;
  for (const hexmesh::VoxelMaterial& m : lattice.materials) {
    softest = std::min(softest, m.material.young);
    stiffest = std::max(stiffest, m.material.young);
  }
  return stiffest > most_contrast_in_single * softest;
}

/// A motion makes its factors again and again. Coarser levels are a poor copy of cells that share stiff and soft: of
/// an inclusion 1e6 times stiffer in 125 cells two levels took 6,800 iterations.
std::size_t coarsest_dofs(const Lattice& lattice, const Scene& scene) {
  constexpr std::size_t of_high_contrast = 2000;
  if (scene.dynamics) return Multigrid::most_dense;
  return is_of_high_contrast(lattice) ? of_high_contrast : Hierarchy::usual_coarsest_dofs;
}

LevelProblem::LevelProblem(const Lattice& lattice, const Scene& scene, int level, Matchings matchings,
                           std::shared_ptr<SharedFindings> shared)
    : LevelProblem(cells_for(lattice, scene, level), scene, std::move(matchings), std::move(shared)) {}

LevelProblem::LevelProblem(MeshCells cells, const Scene& scene, Matchings matchings,
                           std::shared_ptr<SharedFindings> shared)
    : cells_(std::move(cells)),
      scene_(scene),
      progress_(at_the_end(scene)),
      hierarchy_(cells_, coarsest_dofs(cells_.lattice(), scene)),
      shared_(std::move(shared)) {
  hierarchy_.in_double = is_of_high_contrast(cells_.lattice());
  SharedFindings own;
  Selector selector(cells_, mesh());
  if (scene.stiffness_of_cells() == Stiffness::condensed) selector.note_what_acts();
  std::vector<ConstraintPoint> points = select_points(scene, selector);
  if (matchings.empty()) matchings = make_matchings(scene, cells_.lattice());
  std::vector<ConstraintPoint> holding = points;
  const MatchedPoints matched = embed(matchings, selector);
  add_matched_points(matched, holding);
  find_islands(holding);
  for (ConstraintPoint& p : points) p.value = prescribed_displacement(scene, mesh(), p, progress_);
  constraints_ = std::make_unique<Constraints>(mesh(), std::move(points));
  new_loads_ = make_loads(scene, cells_, mesh(), selector);
  for (const auto& load : new_loads_) loads_.push_back(load.get());
  new_contacts_ = make_contacts(scene, cells_, mesh(), selector, (shared_ ? *shared_ : own).shapes);
  for (const auto& contact : new_contacts_) contacts_.push_back(contact.get());
  expect_embedded(scene, matchings, matched);
  new_matches_ = make_match_terms(scene, matchings, mesh(), matched);
  for (const auto& match : new_matches_) matches_.push_back(match.get());
  acting_ = selector.acting();
  set_loads(progress_);
}

bool LevelProblem::attach(const NodeVector& u, const PullMode& mode) {
  if (!matches_.empty()) hexsolver::attach(matches_, *elastic_, potential_->at_all(u), mode);
  attach_contacts(u, mode.learns, mode.stiffer);
  if (carrying_) carrying_->anchor(potential_->at_all(u));
  return !matches_.empty() || has_attached_contacts() || carrying_;
}

bool LevelProblem::has_attached_contacts() const {
  return std::any_of(contacts_.begin(), contacts_.end(), [](const auto* c) { return c->is_attached(); });
}

bool LevelProblem::passes_through_itself(const NodeVector& u) const {
  return std::any_of(contacts_.begin(), contacts_.end(),
                     [&](const auto* c) { return c->passes_through(potential_->at_all(u)); });
}

std::vector<TouchPoint> LevelProblem::touch_points(const NodeVector& u) const {
  std::vector<TouchPoint> out;
  for (const PenaltyContact* c : contacts_) {
    const std::vector<TouchPoint> of_one = c->touch_points(potential_->at_all(u));
    out.insert(out.end(), of_one.begin(), of_one.end());
  }
  return out;
}

double LevelProblem::attach_contacts(const NodeVector& u, double learns, double stiffer) {
  double changed = 0;
  for (PenaltyContact* c : contacts_) changed = std::max(changed, c->attach(potential_->at_all(u), learns, stiffer));
  return changed;
}

bool LevelProblem::settle_contacts(const NodeVector& u) {
  bool settles = false;
  for (PenaltyContact* c : contacts_) settles = c->settle(potential_->at_all(u)) || settles;
  if (carrying_) carrying_->fade();
  return settles || carrying_;
}

void LevelProblem::unsettle_contacts() {
  for (PenaltyContact* c : contacts_) c->unsettle();
  if (carrying_) carrying_->unfade();
}

void LevelProblem::forget_frictions(const NodeVector& u) {
  for (PenaltyContact* c : contacts_) c->forget(potential_->at_all(u));
}

double LevelProblem::keep_contacts(const NodeVector& u) {
  double work = 0;
  for (PenaltyContact* c : contacts_) {
    work += c->keep(potential_->at_all(u));
    if (!scene_.dynamics) c->remember_force(potential_->at_all(u));
  }
  return work;
}

void LevelProblem::set_rest(const NodeVector& to_rest) {
  to_rest_ = to_rest;
  if (potential_) elastic_->set_rest(at_all_nodes(mesh(), to_rest_));
}

void LevelProblem::grow_prestress() {
  if (prestretches_.empty() || of_lattice_) return;
  elastic_->set_prestretch(prestretches_, progress_.fraction);
  const auto dofs = 3 * static_cast<Eigen::Index>(mesh().num_all_nodes());
  elastic_->set_rest(to_rest_.size() > 0 ? at_all_nodes(mesh(), to_rest_) : NodeVector(NodeVector::Zero(dofs)));
}

void LevelProblem::balance_lattice() {
  const NodeVector to_rest = at_all_nodes(mesh(), to_rest_);
  NodeVector forces = NodeVector::Zero(to_rest.size()), magnitude = forces;
  elastic_->add_gradient_on_lattice(to_rest, forces, magnitude);
  elastic_->set_rest(to_rest);
  std::vector<DeadLoad::NodeForce> of_nodes;
  for (std::int32_t n = 0; n < static_cast<std::int32_t>(mesh().num_all_nodes()); ++n)
    of_nodes.push_back({n, forces.segment<3>(3 * Eigen::Index{n})});
  auto balancing = std::make_unique<DeadLoad>(EffectKind::elasticity, "lattice", std::move(of_nodes));
  balancing->set_factor(Vec3::Constant(1 - progress_.fraction));
  of_lattice_ = balancing.get();
  potential_->add(std::move(balancing));
}

NodeVector start_of(const Scene& scene, const Mesh& mesh) {
  NodeVector u = NodeVector::Zero(static_cast<Eigen::Index>(mesh.num_dofs()));
  if (scene.pose)
    for (std::size_t n = 0; n < mesh.num_nodes(); ++n)
      u.segment<3>(3 * static_cast<Eigen::Index>(n)) = *scene.pose * mesh.position(n) - mesh.position(n);
  return u;
}

void LevelProblem::set_progress(const Progress& progress) {
  if (progress == progress_) {  // a step of the same load begins
    for (PenaltyContact* c : contacts_) c->set_progress(progress);
    return;
  }
  progress_ = progress;
  const std::vector<ConstraintPoint>& points = constraints_->points();
  prescribed_.resize(points.size());
  for (std::size_t p = 0; p < points.size(); ++p)
    prescribed_[p] = prescribed_displacement(scene_, mesh(), points[p], progress);
  constraints_->prescribe(prescribed_);
  if (!scene_.dynamics)
    prescribed_ = std::vector<Vec3>();  // a motion prescribes at every step and asks for no memory then
  set_loads(progress);
}

void LevelProblem::set_loads(const Progress& progress) {
  const Vec3 whole = Vec3::Constant(scene_.dynamics ? 1 : progress.fraction);
  for (std::size_t n = 0; n < loads_.size(); ++n) {
    const bool changes = n < scene_.forces.size() && scene_.forces[n].history;
    loads_[n]->set_factor(changes ? scene_.forces[n].history->at(progress.time) : whole);
  }
  if (of_lattice_) of_lattice_->set_factor(Vec3::Constant(1 - progress.fraction));
  if (potential_) grow_prestress();
  for (PenaltyContact* c : contacts_) c->set_progress(progress);
  for (MatchTerm* m : matches_) m->set_progress(progress);
  if (grabs_) grabs_->set_time(progress.time);
}

std::vector<LevelProblem::LoadTotal> LevelProblem::loads(const NodeVector& u) const {
  const NodeVector all = at_all_nodes(mesh(), u);
  std::vector<LoadTotal> out;
  for (std::size_t n = 0; n < loads_.size(); ++n)
    out.push_back({n < scene_.forces.size() ? scene_.forces[n].name : loads_[n]->name(), loads_[n]->total(all)});
  return out;
}

NodeVector LevelProblem::load(const NodeVector& u) const {
  return loads_.empty() ? NodeVector() : forces_of(loads_, mesh(), u);
}

void LevelProblem::find_islands(const std::vector<ConstraintPoint>& points) {
  if (scene_.dynamics && scene_.islands != Islands::hold) return;  // what nothing holds moves
  const std::vector<FreePart> free = free_parts(mesh(), points);
  if (free.empty()) return;
  if (is_carried_by_contacts(scene_)) {
    for (const FreePart& part : free) carried_.insert(carried_.end(), part.cells.begin(), part.cells.end());
    std::sort(carried_.begin(), carried_.end());
    return;
  }
  const bool may_be_held = only_islands_among(free, mesh());
  if (scene_.dynamics && !may_be_held) return;
  if (scene_.islands != Islands::hold || !may_be_held) fail_unsupported(free, scene_, level(), may_be_held);
  islands_.resize(mesh().num_cells());
  for (const FreePart& part : free)
    for (const std::int32_t c : part.cells) islands_[static_cast<std::size_t>(c)] = true;
}

std::size_t LevelProblem::num_island_cells() const {
  return static_cast<std::size_t>(std::count(islands_.begin(), islands_.end(), true));
}

Vec3 LevelProblem::spring_force(const NodeVector& u) const { return springs_ ? springs_->force(u) : Vec3::Zero(); }

double LevelProblem::strain_energy(const NodeVector& u) const { return elastic_->energy(potential_->at_all(u)); }

double LevelProblem::energy_of_springs(const NodeVector& u) const {
  return (springs_ ? springs_->energy(u) : 0) + (grabs_ ? grabs_->energy(potential_->at_all(u)) : 0) +
         (patch_springs_ ? patch_springs_->energy(potential_->at_all(u)) : 0);
}

double LevelProblem::contact_energy(const NodeVector& u) const {
  double sum = energy_of_springs(u);
  for (const PenaltyContact* c : contacts_) sum += c->stored_energy(u);
  return sum;
}

double LevelProblem::work_of_obstacles(const NodeVector& u, const Progress& begin, const Progress& end) const {
  double work = grabs_ ? grabs_->work_of_motion(potential_->at_all(u), begin.time, end.time) : 0;
  for (const PenaltyContact* c : contacts_) work += c->work_of_motion(potential_->at_all(u), begin, end);
  if (patch_springs_)
    work += patch_springs_->work_of_motion(potential_->at_all(u), [&](const ConstraintPoint& p) {
      return Vec3(prescribed_displacement(scene_, mesh(), p, end) - prescribed_displacement(scene_, mesh(), p, begin));
    });
  return work;
}

bool LevelProblem::grasp(std::size_t hand, const hexmesh::TriangleSurface& surface, double reach, const NodeVector& u) {
  const Vec3& middle = surface.points[hand];
  std::vector<Vec3> places = {middle};
  for (std::size_t p = 0; p < surface.points.size(); ++p)
    if (p != hand && (surface.points[p] - middle).norm() <= reach) places.push_back(surface.points[p]);
  std::vector<SurfacePoint> points = Selector(cells_, mesh()).embed(places);
  if (points.front().cell < 0) return false;
  std::erase_if(points, [](const SurfacePoint& p) { return p.cell < 0; });
  double shear = 0, edge = 0;
  for (const SurfacePoint& p : points) {
    const auto cell = hexmesh::as_size(p.cell);
    shear = std::max(shear, elastic_->model(cell).shear);
    edge = std::max(edge, mesh().edges(cell).colwise().norm().maxCoeff());
  }
  if (!grabs_) grabs_ = &add_term(std::make_unique<Grabs>(mesh(), hand_step_of_size * mesh().diameter()));
  constexpr double young_over_shear = 3;
  grabs_->grasp(hand, points, hand_over_young * young_over_shear * shear * std::max(reach, edge),
                potential_->at_all(u));
  return true;
}

double LevelProblem::contact_potential(const NodeVector& u) const {
  double sum = energy_of_springs(u);
  for (const PenaltyContact* c : contacts_) sum += c->energy(u);
  return sum;
}

double LevelProblem::load_energy(const NodeVector& u) const {
  double sum = 0;
  for (const Load* l : loads_) sum += l->energy(potential_->at_all(u));
  return sum;
}

double LevelProblem::largest_load_step() const {
  double step = largest_turning_step(scene_);
  double displaced = 0;
  for (const Condition& c : scene_.conditions) displaced = std::max(displaced, c.by.norm());
  for (const ConstraintPoint& p : constraints_->points())
    if (const auto& turn = scene_.conditions[hexmesh::as_size(p.condition)].turn)
      displaced =
          std::max(displaced, std::abs(turn->radians) *
                                  turn->axis.cross(mesh().rest_position(p.cell, p.weights) - turn->about).norm());
  for (const PenaltyContact* c : contacts_) step = std::min(step, c->largest_load_step(displaced));
  if (!matches_.empty()) step = std::min(step, match_load_step);
  return step;
}

/// Springs that are as soft as the loads let them: rounds are few where obstacles and weight are the stiffer.
std::vector<std::pair<std::int32_t, double>> LevelProblem::carrying_springs() const {
  Vec3 low = mesh().position(0), high = low, force = Vec3::Zero();
  for (std::size_t n = 0; n < mesh().num_nodes(); ++n) {
    low = low.cwiseMin(mesh().position(n));
    high = high.cwiseMax(mesh().position(n));
  }
  const NodeVector at_rest = NodeVector::Zero(3 * static_cast<Eigen::Index>(mesh().num_all_nodes()));
  for (const Load* l : loads_) force += l->total(at_rest);
  double volume = 0;
  for (const std::int32_t c : carried_) volume += elastic_->model(hexmesh::as_size(c)).volume;
  const double in_all = force.norm() / (round_of_size * (high - low).norm());
  const double least = least_carrying * std::pow(static_cast<double>(mesh().num_cells()), -2.0 / 3);
  std::vector<std::pair<std::int32_t, double>> out;
  for (const std::int32_t c : carried_) {
    const ElementModel& model = elastic_->model(hexmesh::as_size(c));
    out.emplace_back(c, std::max(in_all * model.volume / volume / 8, least * model.stiffness.trace() / 24));
  }
  return out;
}

void LevelProblem::build_potential(Elasticity elasticity, std::vector<bool> rotating) {
  SharedFindings own;
  auto condensed = condense(cells_, scene_, acting_, (shared_ ? *shared_ : own).condensed);
  auto elastic = make_elastic_cells(mesh(), cells_,
                                    elastic_settings(scene_, elasticity, std::move(rotating), std::move(condensed)));
  elastic_ = elastic.get();
  if (!scene_.prestresses.empty()) {
    prestretches_ = find_prestretches(cells_, scene_.prestresses, *elastic_, elasticity);
    elastic_->set_prestretch(prestretches_);
  }
  std::vector<std::pair<std::int32_t, double>> springs, carrying;
  const auto spring = [&](std::int32_t c, double part) {
    return std::pair(c, part * elastic_->model(hexmesh::as_size(c)).stiffness.trace() / 24);
  };
  for (std::int32_t c = 0; c < static_cast<std::int32_t>(islands_.size()); ++c)
    if (islands_[hexmesh::as_size(c)]) springs.push_back(spring(c, island_spring));
  if (is_carried()) carrying = carrying_springs();

  potential_ = std::make_unique<Potential>(mesh());
  potential_->add(std::move(elastic));
  if (constraints_->are_soft()) {
    constraints_->set_springs([&, &lattice = cells_.lattice()](const ConstraintPoint& p) {
      const auto cell = hexmesh::as_size(p.cell);
      return PatchSprings::stiffness(p, elastic_->model(cell), mesh().edges(cell), lattice.voxels.voxel_volume());
    });
    patch_springs_ = &add_term(std::make_unique<PatchSprings>(mesh(), constraints_->held()));
  }
  if (!springs.empty())
    springs_ = &add_term(std::make_unique<GroundSprings>(EffectKind::islands, mesh(), std::move(springs)));
  if (!carrying.empty())
    carrying_ = &add_term(std::make_unique<GroundSprings>(EffectKind::elasticity, mesh(), std::move(carrying)));
  if (to_rest_.size() > 0)
    balance_lattice();
  else
    grow_prestress();
  if (scene_.stiffness_of_cells() == Stiffness::condensed && scene_.gravity != Vec3::Zero()) {
    new_loads_.back() = make_weight(scene_.gravity, cells_, *elastic_);
    loads_.back() = new_loads_.back().get();
    set_loads(progress_);
  }
  for (auto& load : new_loads_) potential_->add(std::move(load));
  new_loads_.clear();
  for (auto& contact : new_contacts_) potential_->add(std::move(contact));
  new_contacts_.clear();
  for (auto& match : new_matches_) potential_->add(std::move(match));
  new_matches_.clear();
}

}  // namespace hexsolver
