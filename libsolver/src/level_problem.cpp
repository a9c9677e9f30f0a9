// SPDX-License-Identifier: Apache-2.0
#include "level_problem.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "hexmesh/core/error.h"
#include "hexsolver/loads.h"
#include "hexsolver/selection.h"
#include "hexsolver/supports.h"

namespace hexsolver {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Lattice;

/// Where points cannot come closer than this part of the largest prescribed displacement, conditions contradict.
constexpr double conflict_fraction = 0.05;
/// Stiffness of the springs that hold islands, over the mean diagonal of their cells': they touch nothing else.
constexpr double island_spring = 1;

[[noreturn]] void fail_unsupported(const std::vector<FreePart>& free, const Scene& scene, int level,
                                   bool only_islands) {
  std::vector<std::string> motions;
  for (const FreePart& part : free) {
    motions.insert(motions.end(), part.motions.begin(), part.motions.end());
  }
  throw Error(ErrorKind::geometry, missing_supports(motions, level) +
                                       (scene.contacts.empty() ? "" : " (contacts hold nothing)") +
                                       (only_islands ? ", or solve.islands = \"drop\" or \"hold\"" : ""));
}

/// Whether all free parts are islands, and not the whole body.
bool only_islands_among(const std::vector<FreePart>& free, const Mesh& mesh) {
  std::size_t cells = 0;
  for (const FreePart& part : free) {
    if (!part.is_island) return false;
    cells += part.cells.size();
  }
  return cells < mesh.num_cells();
}

double largest_prescribed(const Constraints& constraints) {
  double largest = 0;
  for (const ConstraintPoint& p : constraints.points()) largest = std::max(largest, p.value.norm());
  return largest;
}

/// Beyond this single precision loses what is soft beside what is stiff: an inclusion 1e4 times stiffer took 346
/// iterations in few cells that share both, 234 in double precision; 1e6 times stiffer it had no end, and 68.
constexpr double most_contrast_in_single = 1e3;

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

/// Words for each condition that the cells cannot follow; empty if there are none.
std::vector<std::string> conflicts_of(const Constraints& constraints, const Scene& scene) {
  std::vector<double> miss(scene.conditions.size());
  const std::vector<double> of_point = constraints.contradiction();
  for (std::size_t p = 0; p < of_point.size(); ++p) {
    double& worst = miss[static_cast<std::size_t>(constraints.held()[p].condition)];
    worst = std::max(worst, of_point[p]);
  }
  std::vector<std::string> words;
  constexpr double rounding = 1e-6;  // mm
  const double allowed = std::max(rounding, conflict_fraction * largest_prescribed(constraints));
  for (std::size_t c = 0; c < miss.size(); ++c)
    if (miss[c] > allowed)
      words.push_back(
          fmt::format("'{}' ({}, misses by {:.3g} mm)", scene.conditions[c].name, scene.conditions[c].where, miss[c]));
  return words;
}

Progress at_the_end(const Scene& scene) { return {1, scene.dynamics ? scene.dynamics->duration : 0}; }

}  // namespace

LevelProblem::LevelProblem(const Lattice& lattice, const Scene& scene, int level)
    : lattice_(lattice),
      scene_(scene),
      level_(level),
      hierarchy_(
          Mesh(lattice.levels[static_cast<std::size_t>(level)].cells, lattice.cell_edges(level), lattice.corner()),
          lattice.corner(), coarsest_dofs(lattice, scene)) {
  hierarchy_.in_double = is_of_high_contrast(lattice);
  Selector selector(lattice, level, mesh());
  std::vector<ConstraintPoint> points = select_points(scene, selector);
  find_islands(points);
  for (ConstraintPoint& p : points) {
    const Condition& condition = scene.conditions[static_cast<std::size_t>(p.condition)];
    p.value = prescribed_displacement(condition, mesh().rest_position(p.cell, p.weights), at_the_end(scene));
  }
  constraints_ = std::make_unique<Constraints>(mesh(), std::move(points));
  new_loads_ = make_loads(scene, lattice, level, mesh(), selector);
  for (const auto& load : new_loads_) loads_.push_back(load.get());
  if (!scene.contacts.empty()) {
    const std::vector<SurfacePoint> surface = selector.whole_surface();
    for (const Contact& c : scene.contacts) {
      new_contacts_.push_back(std::make_unique<PenaltyContact>(c, mesh(), surface));
      contacts_.push_back(new_contacts_.back().get());
    }
  }
  set_progress(at_the_end(scene));
}

void LevelProblem::set_progress(const Progress& progress) {
  const std::vector<ConstraintPoint>& points = constraints_->points();
  prescribed_.resize(points.size());
  for (std::size_t p = 0; p < points.size(); ++p)
    prescribed_[p] = prescribed_displacement(scene_.conditions[static_cast<std::size_t>(points[p].condition)],
                                             mesh().rest_position(points[p].cell, points[p].weights), progress);
  constraints_->prescribe(prescribed_);
  if (!scene_.dynamics)
    prescribed_ = std::vector<Vec3>();  // a motion prescribes at every step and asks for no memory then
  const Vec3 whole = Vec3::Constant(scene_.dynamics ? 1 : progress.fraction);
  for (std::size_t n = 0; n < loads_.size(); ++n) {
    const bool changes = n < scene_.forces.size() && scene_.forces[n].history;
    loads_[n]->set_factor(changes ? scene_.forces[n].history->at(progress.time) : whole);
  }
  for (PenaltyContact* c : contacts_) c->set_progress(progress);
}

std::vector<LevelProblem::Load> LevelProblem::loads() const {
  std::vector<Load> out;
  for (std::size_t n = 0; n < loads_.size(); ++n)
    out.push_back({n < scene_.forces.size() ? scene_.forces[n].name : loads_[n]->name(), loads_[n]->total()});
  return out;
}

void LevelProblem::find_islands(const std::vector<ConstraintPoint>& points) {
  if (scene_.dynamics && scene_.islands != Islands::hold) return;  // what nothing holds moves
  const std::vector<FreePart> free = free_parts(mesh(), points);
  if (free.empty()) return;
  const bool may_be_held = only_islands_among(free, mesh());
  if (scene_.dynamics && !may_be_held) return;
  if (scene_.islands != Islands::hold || !may_be_held) fail_unsupported(free, scene_, level_, may_be_held);
  islands_.resize(mesh().num_cells());
  for (const FreePart& part : free)
    for (const std::int32_t c : part.cells) islands_[static_cast<std::size_t>(c)] = true;
}

std::optional<Lattice> without_islands(const Lattice& lattice, const Scene& scene, int level, std::size_t& dropped) {
  dropped = 0;
  if (scene.islands == Islands::error) return {};
  const Mesh mesh(lattice.levels[static_cast<std::size_t>(level)].cells, lattice.cell_edges(level), lattice.corner());
  Selector selector(lattice, level, mesh);
  const std::vector<FreePart> free = free_parts(mesh, select_points(scene, selector));
  if (!only_islands_among(free, mesh)) return {};
  std::vector<std::int32_t> cells;
  for (const FreePart& part : free)
    if (scene.islands == Islands::drop || part.hangs) cells.insert(cells.end(), part.cells.begin(), part.cells.end());
  dropped = cells.size();
  if (cells.empty()) return {};
  return hexmesh::without_cells(lattice, level, cells);
}

Scene for_coarser_levels(Scene scene) {
  const auto by_faces = [](Selection& s) {
    if (s.on == SurfacePoints::nodes) s.on = SurfacePoints::faces;
  };
  for (Condition& c : scene.conditions) by_faces(c.selection);
  for (Force& f : scene.forces) by_faces(f.selection);
  return scene;
}

std::size_t LevelProblem::num_island_cells() const {
  return static_cast<std::size_t>(std::count(islands_.begin(), islands_.end(), true));
}

Vec3 LevelProblem::spring_force(const NodeVector& u) const { return springs_ ? springs_->force(u) : Vec3::Zero(); }

double LevelProblem::contact_energy(const NodeVector& u) const {
  double sum = springs_ ? springs_->energy(u) : 0;
  for (const PenaltyContact* c : contacts_) sum += c->energy(u);
  return sum;
}

double LevelProblem::load_energy(const NodeVector& u) const {
  double sum = 0;
  for (const DeadLoad* l : loads_) sum += l->energy(u);
  return sum;
}

double LevelProblem::largest_load_step() const {
  double step = largest_turning_step(scene_);
  for (const PenaltyContact* c : contacts_) step = std::min(step, c->largest_load_step());
  return step;
}

double largest_turning_step(const Scene& scene) {
  double step = 1;
  for (const Condition& c : scene.conditions)
    if (c.turn && c.turn->radians != 0) step = std::min(step, std::numbers::pi / 2 / std::abs(c.turn->radians));
  return step;
}

void LevelProblem::build_potential(Elasticity elasticity, std::vector<bool> turning) {
  auto elastic = make_elastic_cells(
      mesh(), lattice_, level_,
      {elasticity, scene_.rotation, scene_.volumetric, scene_.stiffness, std::move(turning), scene_.saves_memory});
  elastic_ = elastic.get();
  std::vector<std::pair<std::int32_t, double>> springs;
  for (std::size_t c = 0; c < islands_.size(); ++c)
    if (islands_[c])
      springs.emplace_back(static_cast<std::int32_t>(c), island_spring * elastic_->model(c).stiffness.trace() / 24);

  potential_ = std::make_unique<Potential>(mesh());
  potential_->add(std::move(elastic));
  if (!springs.empty()) {
    auto term = std::make_unique<GroundSprings>(mesh(), std::move(springs));
    springs_ = term.get();
    potential_->add(std::move(term));
  }
  for (auto& load : new_loads_) potential_->add(std::move(load));
  new_loads_.clear();
  for (auto& contact : new_contacts_) potential_->add(std::move(contact));
  new_contacts_.clear();
}

int first_nested_level(const Lattice& lattice, int finest) {
  std::vector<std::size_t> num_cells;
  for (const hexmesh::Level& level : lattice.levels) num_cells.push_back(level.cells.size());
  return first_nested_level(num_cells, finest);
}

int first_nested_level(const std::vector<std::size_t>& num_cells, int finest) {
  constexpr std::size_t least_cells = 8;
  int first = finest;
  for (int coarser = finest + 1; coarser < static_cast<int>(num_cells.size()); ++coarser)
    if (num_cells[static_cast<std::size_t>(coarser)] >= least_cells) first = coarser;
  return first;
}

std::vector<ConditionReport> report_points(const LevelProblem& problem) {
  return report_points(problem.constraints(), problem.scene());
}

std::vector<ConditionReport> report_points(const Constraints& constraints, const Scene& scene) {
  std::vector<ConditionReport> out;
  for (const Condition& c : scene.conditions) out.push_back({c.name, 0, 0, 0, Vec3::Zero()});
  for (const ConstraintPoint& p : constraints.points()) ++out[static_cast<std::size_t>(p.condition)].points;
  const std::vector<std::size_t> kept = constraints.kept_by_condition(out.size());
  for (std::size_t c = 0; c < kept.size(); ++c) out[c].kept = kept[c];
  return out;
}

std::vector<std::string> check_single_points(const Scene& scene) {
  std::vector<std::string> warnings;
  const auto check = [&](const char* kind, const std::string& name, const std::string& where, const Selection& s) {
    if (std::none_of(s.balls.begin(), s.balls.end(), [](const Ball& b) { return b.radius == 0; })) return;
    const std::string what = fmt::format(
        "{} '{}' ({}) is on single points (radius_mm = 0), where the displacement has no limit as cells get smaller",
        kind, name, where);
    if (scene.accuracy) throw Error(ErrorKind::input, what + ", expected a radius > 0 with accuracy_mm");
    warnings.push_back(what);
  };
  for (const Condition& c : scene.conditions) check("condition", c.name, c.where, c.selection);
  for (const Force& f : scene.forces) check("force", f.name, f.where, f.selection);
  return warnings;
}

void check_open_ended(const Scene& scene, const Lattice& lattice, int finest) {
  if (!scene.accuracy && !scene.budget) return;
  const auto check = [](const char* kind, const std::string& name, const std::string& where, const Selection& s) {
    if (s.on == SurfacePoints::nodes)
      throw Error(ErrorKind::input, fmt::format("{} '{}' ({}) is on = \"nodes\", which are other points on each level, "
                                                "expected faces or voxels with accuracy_mm and budget_s",
                                                kind, name, where));
  };
  for (const Condition& c : scene.conditions) check("condition", c.name, c.where, c.selection);
  for (const Force& f : scene.forces) check("force", f.name, f.where, f.selection);
  if (scene.accuracy && first_nested_level(lattice, finest) == finest)
    throw Error(
        ErrorKind::input,
        fmt::format("accuracy_mm is {:g}, expected a lattice with a coarser level of at least 8 cells to compare "
                    "with",
                    *scene.accuracy));
}

namespace {

std::vector<std::string> check_contacts(const LevelProblem& problem, const NodeVector* start) {
  constexpr double most_overlap = 5;  // mm
  std::vector<std::string> warnings;
  for (std::size_t c = 0; c < problem.contacts().size(); ++c) {
    const Contact& contact = problem.scene().contacts[c];
    const PenaltyContact& term = *problem.contacts()[c];
    const PenaltyContact::State state = start ? term.state(*start) : term.state_at_rest();
    if (state.points == 0) continue;
    const std::string what =
        fmt::format("contact '{}' ({}): {} surface points are inside it {}, up to {:.3g} mm", contact.name,
                    contact.where, state.points, start ? "at the start" : "at rest", state.deepest);
    if (state.deepest > most_overlap)
      throw Error(ErrorKind::geometry,
                  fmt::format("{}, expected at most {:g} mm: let it move in with by_mm", what, most_overlap));
    warnings.push_back(what);
  }
  return warnings;
}

}  // namespace

std::vector<std::string> check_contacts_at(const LevelProblem& problem, const NodeVector& u) {
  return check_contacts(problem, &u);
}

std::vector<std::string> check_conflicts(const Constraints& constraints, int level, const Scene& scene) {
  const std::vector<std::string> conflicts = conflicts_of(constraints, scene);
  if (conflicts.empty()) return {};
  const std::string what =
      fmt::format("conditions contradict each other at level {}: {}", level, fmt::join(conflicts, " and "));
  if (scene.compromise) return {what + "; they are met by least squares"};
  throw Error(ErrorKind::geometry,
              fmt::format("{}, expected displacements that the cells can follow (a finer level, patches farther apart, "
                          "or solve.conflicts = \"compromise\")",
                          what));
}

std::vector<std::string> check_level(const LevelProblem& problem, const Scene& scene) {
  std::vector<std::string> warnings = check_conflicts(problem.constraints(), problem.level(), scene);
  const std::vector<std::string> overlaps = check_contacts(problem, nullptr);
  warnings.insert(warnings.end(), overlaps.begin(), overlaps.end());
  return warnings;
}

}  // namespace hexsolver
