// SPDX-License-Identifier: Apache-2.0
#include "level/checks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "hexmesh/core/error.h"
#include "level/coarser_levels.h"

namespace hexsolver {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;

/// Where points cannot come closer than this part of the largest prescribed displacement, conditions are incompatible.
constexpr double conflict_fraction = 0.05;
double largest_prescribed(const Constraints& constraints) {
  double largest = 0;
  for (const ConstraintPoint& p : constraints.points()) largest = std::max(largest, p.value.norm());
  return largest;
}

/// Words for each condition that the cells cannot follow; empty if there are none.
std::vector<std::string> conflicts_of(const Constraints& constraints, const Scene& scene) {
  std::vector<double> miss(scene.conditions.size());
  const std::vector<double> of_point = constraints.incompatibility();
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

}  // namespace

std::vector<std::string> check_single_points(const Scene& scene) {
  std::vector<std::string> warnings;
  const auto check = [&](const char* kind, const std::string& name, const std::string& where, const Selection& s) {
    if (std::none_of(s.balls.begin(), s.balls.end(), [](const Ball& b) { return b.radius == 0; })) return;
    const std::string what = fmt::format(
        "{} '{}' ({}) is on single points (radius_mm = 0), where the displacement has no limit as cells get smaller",
        kind, name, where);
    if (scene.asks_accuracy()) throw Error(ErrorKind::input, what + ", expected a radius > 0 with an accuracy");
    warnings.push_back(what);
  };
  for (const Condition& c : scene.conditions) check("condition", c.name, c.where, c.selection);
  for (const Force& f : scene.forces) check("force", f.name, f.where, f.selection);
  return warnings;
}

void check_contrast(const hexmesh::Lattice& lattice) {
  constexpr double most = 1e10;
  const auto [softest, stiffest] =
      std::minmax_element(lattice.materials.begin(), lattice.materials.end(),
                          [](const auto& a, const auto& b) { return a.material.young < b.material.young; });
  if (stiffest->material.young > most * softest->material.young)
    throw Error(ErrorKind::input, fmt::format("Young's moduli are {:g} to {:g} kPa, expected at most {:g} times the "
                                              "least: what is soft would be lost in the rounding of what is stiff",
                                              1e3 * softest->material.young, 1e3 * stiffest->material.young, most));
}

void warn_of_rounding(double rounding, double forces, const std::vector<BalanceReport::Row>& loads,
                      std::vector<std::string>& warnings) {
  constexpr double allowed = 1e-3;
  const bool is_loaded =
      std::any_of(loads.begin(), loads.end(), [](const BalanceReport::Row& r) { return r.force_n.norm() > 0; });
  if (rounding <= allowed * forces || (forces <= rounding && !is_loaded)) return;
  warnings.push_back(
      fmt::format("residual forces of up to {:.2g} N count as rounding beside the stiffest material, and "
                  "the forces on the nodes are {:.2g} N: trust few digits of displacements and reactions",
                  rounding, forces));
}

void check_open_ended(const Scene& scene, const std::vector<std::size_t>& num_cells, int finest) {
  if (!scene.is_open_ended()) return;
  if (scene.loaded && acts_after_loaded(scene))
    throw Error(ErrorKind::input,
                "an accuracy or budget_s goes with solve.reference = \"loaded\" where nothing acts afterwards, nor a "
                "[[prestress]], expected solve.level");
  const auto check = [](const char* kind, const std::string& name, const std::string& where, const Selection& s) {
    if (s.on == SurfacePoints::nodes)
      throw Error(ErrorKind::input, fmt::format("{} '{}' ({}) is on = \"nodes\", which are other points on each level, "
                                                "expected faces or voxels with an accuracy or budget_s",
                                                kind, name, where));
  };
  for (const Condition& c : scene.conditions) check("condition", c.name, c.where, c.selection);
  for (const Force& f : scene.forces) check("force", f.name, f.where, f.selection);
  if (scene.asks_accuracy() && first_nested_level(num_cells, finest) == finest)
    throw Error(ErrorKind::input,
                fmt::format("{} is {:g}, expected a lattice with a coarser level of at least 8 cells to compare with",
                            scene.accuracy ? "accuracy_mm" : "accuracy_reactions",
                            scene.accuracy ? *scene.accuracy : *scene.reaction_accuracy));
  if (scene.reaction_accuracy && scene.conditions.empty())
    throw Error(ErrorKind::input,
                fmt::format("accuracy_reactions is {:g}, expected a scene with a [[fix]] or a [[displace]]",
                            *scene.reaction_accuracy));
}

namespace {

/// What presses in the scan is inside there: of a body that is scanned under load nothing is told.
std::vector<std::string> check_contacts(const LevelProblem& problem, const NodeVector* start) {
  constexpr double most_overlap = 5;  // mm
  std::vector<std::string> warnings;
  if (problem.scene().loaded) return warnings;
  for (std::size_t c = 0; c < problem.contacts().size(); ++c) {
    const Contact& contact = problem.scene().contacts[c];
    const PenaltyContact& term = *problem.contacts()[c];
    const PenaltyContact::State state = start ? term.state(*start) : term.state_before(problem.start());
    if (state.is_inside)
      throw Error(ErrorKind::geometry, fmt::format("contact '{}' ({}): the obstacle is inside the body {}, expected "
                                                   "outside: let it move in with by_mm",
                                                   contact.name, contact.where, start ? "at the start" : "at rest"));
    constexpr double rounding = 1e-9;  // mm
    if (state.points == 0 || state.deepest < rounding) continue;
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
      fmt::format("conditions are incompatible at level {}: {}", level, fmt::join(conflicts, " and "));
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
