// SPDX-License-Identifier: Apache-2.0
#include "conclude.h"

#include <fmt/format.h>

#include <algorithm>

#include "hexmesh/lattice/embedded_points.h"
#include "hexsolver/cell_measures.h"

namespace hexsolver {
namespace {

using hexmesh::Lattice;
using hexmesh::Result;

/// What lies beside the cells.
void add_surface_and_conditions(const Lattice& lattice, const LevelProblem& problem, const NodeVector& u, Result& r) {
  const hexmesh::Level& level = lattice.levels[static_cast<std::size_t>(problem.level())];
  const Mesh& mesh = problem.mesh();
  if (!problem.islands().empty()) r.cell_fields["island"] = {problem.islands().begin(), problem.islands().end()};

  const hexmesh::CellLocator locator(lattice.voxels, level.voxels_per_cell, level.cells);
  hexmesh::EmbeddedPoints(locator, mesh.cell_nodes(), lattice.surface.points)
      .interpolate({u.data(), static_cast<std::size_t>(u.size())}, r.surface_displacement);

  for (const Condition& c : problem.scene().conditions) r.conditions.push_back({c.name, {}, {}, c.axes});
  add_condition_points(problem.constraints(), mesh, u, r.conditions);
}

void add_measures(CellMeasures& measures, Result& result) {
  for (std::size_t d = 0; d < 3; ++d)
    result.cell_fields[fmt::format("principal_stretch_{}", d + 1)] = std::move(measures.principal_stretch[d]);
  result.cell_fields["min_jacobian"] = std::move(measures.min_jacobian);
  result.cell_fields["rotation_degrees"] = std::move(measures.rotation_degrees);
  result.cell_fields["young_modulus"] = std::move(measures.young_modulus);
  result.cell_fields["poisson_ratio"] = std::move(measures.poisson_ratio);
  result.cell_fields["von_mises_stress"] = std::move(measures.von_mises_stress);
  result.cell_fields["pressure"] = std::move(measures.pressure);
  result.cell_fields["smoothed_pressure"] = std::move(measures.smoothed_pressure);
}

constexpr double least_stretch = 0.7, most_stretch = 1.4;  // where Hooke's law is meant for
constexpr double small_degrees = 10;

}  // namespace

CellChanges count_changes(const Result& result, std::size_t first, std::size_t count) {
  const std::vector<double>&longest = result.cell_fields.at("principal_stretch_1"),
        &shortest = result.cell_fields.at("principal_stretch_3"), &rotation = result.cell_fields.at("rotation_degrees"),
        &jacobian = result.cell_fields.at("min_jacobian");
  CellChanges changes;
  changes.cells = count;
  for (std::size_t c = first; c < first + count; ++c) {
    changes.strained += longest[c] > most_stretch || shortest[c] < least_stretch;
    changes.turned += rotation[c] > small_degrees;
    changes.inverted += jacobian[c] <= 0;
    changes.least_jacobian = std::min(changes.least_jacobian, jacobian[c]);
  }
  return changes;
}

void report_changes(const CellChanges& changes, SolveReport& report) {
  constexpr double allowed_part = 0.05;
  report.min_jacobian = changes.least_jacobian;
  report.inverted_cells = changes.inverted;
  if (report.inverted_cells > 0)
    report.warnings.push_back(
        fmt::format("{} cells are inverted, least Jacobian {:.2g}: there the solution has no meaning",
                    report.inverted_cells, report.min_jacobian));
  else if (report.min_jacobian < 0.1)
    report.warnings.push_back(
        fmt::format("the least Jacobian is {:.2g}: cells are nearly flat there, trust little", report.min_jacobian));
  const auto part = [&](std::size_t count) { return static_cast<double>(count) / static_cast<double>(changes.cells); };
  if (!is_hyperelastic(report.elasticity) && part(changes.strained) > allowed_part)
    report.warnings.push_back(
        fmt::format("{:.0f} % of the cells are stretched beyond {:g} to {:g}: Hooke's law is for small strain, "
                    "law = \"neo-hookean\" for large",
                    100 * part(changes.strained), least_stretch, most_stretch));
  if (report.elasticity == Elasticity::cauchy && part(changes.turned) > allowed_part)
    report.warnings.push_back(fmt::format(
        "{:.0f} % of the cells turn by more than {:g} degrees, which strain = \"cauchy\" takes for strain; the "
        "error estimate does not know",
        100 * part(changes.turned), small_degrees));
}

namespace {

void report_conditions(const LevelProblem& problem, const NodeVector& u, SolveReport& report) {
  NodeVector gradient, magnitude;
  problem.potential().gradient(u, gradient, magnitude);
  for (const LevelProblem::Load& load : problem.loads()) report.forces.push_back({load.name, load.total});
  for (std::size_t c = 0; c < problem.contacts().size(); ++c) {
    const PenaltyContact::State state = problem.contacts()[c]->state(u);
    report.contacts.push_back(
        {problem.scene().contacts[c].name, state.points, state.deepest, state.nearest, state.force});
    if (state.points == 0 && !problem.scene().dynamics)
      report.warnings.push_back(fmt::format("{} touches nothing: the nearest surface point is {:.3g} mm away",
                                            problem.contacts()[c]->name(), state.nearest));
  }
  report_constraints(problem.constraints(), problem.scene(), u, gradient, report);
}

}  // namespace

void report_constraints(const Constraints& constraints, const Scene& scene, const NodeVector& u,
                        const NodeVector& gradient, SolveReport& report) {
  report.conditions = report_points(constraints, scene);
  for (const ConstraintPoint& p : constraints.points()) {
    ConditionReport& r = report.conditions[static_cast<std::size_t>(p.condition)];
    Vec3 miss = p.value - constraints.displacement(p, u);
    for (int d = 0; d < 3; ++d)
      if (!p.axes[static_cast<std::size_t>(d)]) miss[d] = 0;
    r.misfit_mm = std::max(r.misfit_mm, miss.norm());
  }
  const std::vector<Vec3> forces = constraints.multipliers(gradient);
  for (std::size_t p = 0; p < forces.size(); ++p)
    report.conditions[static_cast<std::size_t>(constraints.held()[p].condition)].reaction_n += forces[p];
  report.kept_directions = constraints.num_kept();
  report.constraint_violation_mm = constraints.violation(u);
  // What is known to be off at the conditions is part of the error.
  if (std::optional<double>& largest = report.levels.back().error.max_mm)
    for (const ConditionReport& c : report.conditions) largest = std::max(*largest, c.misfit_mm);
}

std::vector<Vec3> to_points(const NodeVector& u) {
  std::vector<Vec3> out(static_cast<std::size_t>(u.size() / 3));
  for (std::size_t n = 0; n < out.size(); ++n) out[n] = u.segment<3>(3 * static_cast<Eigen::Index>(n));
  return out;
}

void warn_of_dropped_cells(const Lattice& whole, int level, SolveReport& report) {
  report.warnings.push_back(fmt::format("{} of {} cells of level {} are left out: nothing holds them",
                                        report.dropped_cells,
                                        whole.levels[static_cast<std::size_t>(level)].cells.size(), level));
}

void add_effect_seconds(const LevelProblem& problem, SolveReport& report) {
  const char* linearized = is_hyperelastic(report.elasticity) ? "large strain" : "rotation";
  for (const Potential::Cost& cost : problem.potential().costs())
    for (Effect& e : report.effects) {
      if (e.name == cost.name) e.seconds += cost.seconds - cost.linearize_seconds;
      if (e.name == linearized && cost.name == problem.elastic().name()) e.seconds += cost.linearize_seconds;
    }
}

void add_condition_points(const Constraints& constraints, const Mesh& mesh, const NodeVector& u,
                          std::vector<hexmesh::ConditionPoints>& conditions) {
  for (const ConstraintPoint& p : constraints.points()) {
    hexmesh::ConditionPoints& condition = conditions[static_cast<std::size_t>(p.condition)];
    condition.points.push_back(mesh.rest_position(p.cell, p.weights));
    condition.displacement.push_back(constraints.displacement(p, u));
  }
}

Result state_of_cells(const Lattice& lattice, int number, const ElasticCells& elastic, const NodeVector& u,
                      CellMeasures measures) {
  const hexmesh::Level& level = lattice.levels[static_cast<std::size_t>(number)];
  Result r = hexmesh::rest_state(lattice, number);
  r.displacement = to_points(u);
  const double cell_volume = lattice.cell_size(number).prod();
  std::vector<double>& density = r.cell_fields["strain_energy_density"];
  for (std::size_t c = 0; c < level.cells.size(); ++c)
    density.push_back(elastic.cell_energy(c, u) / (level.fill(c) * cell_volume));
  add_measures(measures, r);
  return r;
}

Result conclude(const Lattice& lattice, const LevelProblem& problem, const NodeVector& u, SolveReport& report) {
  report.strain_energy_n_mm = problem.elastic().energy(u);
  report.held_cells = problem.num_island_cells();
  report.held_force_n = problem.spring_force(u);
  if (report.held_cells > 0)
    report.warnings.push_back(fmt::format("{} cells are held by springs: nothing else holds them", report.held_cells));
  report_conditions(problem, u, report);
  for (const Potential::Cost& cost : problem.potential().costs()) report.bytes.emplace_back(cost.name, cost.bytes);
  CellMeasures measures = measure_cells(problem.elastic(), u);
  report.pressure_checkerboard = measures.pressure_checkerboard;
  Result result = state_of_cells(lattice, problem.level(), problem.elastic(), u, std::move(measures));
  add_surface_and_conditions(lattice, problem, u, result);
  if (report.converged)
    if (const std::string limit = problem.elastic().limit_reached(u, false); !limit.empty())
      report.warnings.push_back(limit);
  report_changes(count_changes(result, 0, result.cells.size()), report);
  return result;
}

}  // namespace hexsolver
