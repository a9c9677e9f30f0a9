// SPDX-License-Identifier: Apache-2.0
#include "level/make_result.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "level/cell_changes.h"
#include "level/checks.h"
#include "level/condition_reports.h"
#include "level/on_level.h"
#include "mesh/points.h"
#include "terms/cell_measures.h"

namespace hexsolver {
namespace {

using hexmesh::Lattice;
using hexmesh::Result;

/// What lies beside the cells.
void add_surface_and_conditions(const LevelProblem& problem, const NodeVector& u, const OnLevel* level, Result& r) {
  const Mesh& mesh = problem.mesh();
  if (!problem.scene().dynamics)  // in a motion each state would have its own
    r.load = forces_at_points(problem.load(u), level);
  r.contact_force = contact_forces(problem, u, level);

  if (!r.surface.points.empty()) move_surface(r);
  for (const Condition& c : problem.scene().conditions) r.conditions.push_back({c.name, {}, {}, c.axes});
  add_condition_points(problem.constraints(), mesh, u, r.conditions);
}

void add_measures(CellMeasures& measures, CellFields& fields) {
  for (std::size_t d = 0; d < 3; ++d)
    fields[fmt::format("principal_stretch_{}", d + 1)] = std::move(measures.principal_stretch[d]);
  fields["min_jacobian"] = std::move(measures.min_jacobian);
  fields["volume_ratio"] = std::move(measures.volume_ratio);
  fields["inverted_part"] = std::move(measures.inverted_part);
  fields["rotation_degrees"] = std::move(measures.rotation_degrees);
  fields["young_modulus"] = std::move(measures.young_modulus);
  fields["poisson_ratio"] = std::move(measures.poisson_ratio);
  fields["von_mises_stress"] = std::move(measures.von_mises_stress);
  fields["pressure"] = std::move(measures.pressure);
  fields["smoothed_pressure"] = std::move(measures.smoothed_pressure);
}

void add_energy(const ElasticCells& elastic, const NodeVector& u, CellFields& fields) {
  std::vector<double>& density = fields["strain_energy_density"];
  for (std::size_t c = 0; c < elastic.mesh().num_cells(); ++c)
    density.push_back(elastic.cell_energy(c, u) / elastic.model(c).volume);
}

void report_conditions(const Lattice& lattice, const LevelProblem& problem, const NodeVector& u, SolveReport& report) {
  NodeVector gradient, magnitude;
  problem.potential().gradient(u, gradient, magnitude);
  for (const LevelProblem::LoadTotal& load : problem.loads(u)) report.forces.push_back({load.name, load.total});
  report.contacts = contact_reports(problem, u);
  for (const ContactReport& c : report.contacts)
    if (c.points == 0 && !problem.scene().dynamics && !problem.scene().is_of_lattice)
      report.warnings.push_back("contact '" + c.name + "' touches nothing: " +
                                (std::isnan(c.nearest_mm)
                                     ? "no surface point is near the other segment"
                                     : fmt::format("the nearest surface point is {:.3g} mm away", c.nearest_mm)));
  report_matches(problem.matches(), problem.start(), u, report);
  report.pose = problem.scene().pose;
  const Arms arms(lattice, report.elasticity);
  report_constraints(problem.constraints(), problem.scene(), problem.mesh(), u, gradient, arms, report);
  std::vector<BalanceReport::Row> loads;
  NodeVector inner = gradient;  // of the cells
  problem.potential().for_each_load(u, [&](const std::string& name, const NodeVector& forces) {
    loads.push_back(resultant(name, forces, problem.mesh(), u, arms));
    inner += forces;
  });
  if (!problem.potential().is_linear() && !problem.scene().dynamics && report.load_fraction > 0)
    warn_of_rounding(problem.potential().rounding(), inner.norm(), loads, report.warnings);
  report_balance(problem.scene(), arms, loads, report);
}

/// The principal stretches of F0 of each cell, the largest first.
void add_prestretches(const std::vector<Mat3>& prestretches, CellFields& fields) {
  for (const Mat3& f : prestretches) {
    const Vec3 stretches = Eigen::SelfAdjointEigenSolver<Mat3>(f, Eigen::EigenvaluesOnly).eigenvalues();
    for (int d = 0; d < 3; ++d) fields[fmt::format("prestretch_{}", d + 1)].push_back(stretches[2 - d]);
  }
}

}  // namespace

void add_effect_seconds(const Potential& potential, SolveReport& report) {
  const EffectKind linearized = is_hyperelastic(report.elasticity) ? EffectKind::large_strain : EffectKind::rotation;
  for (const Potential::Cost& cost : potential.costs())
    for (Effect& e : report.effects) {
      if (e.kind == cost.effect && e.name == cost.name) e.seconds += cost.seconds - cost.linearize_seconds;
      if (e.kind == linearized && cost.effect == EffectKind::elasticity) e.seconds += cost.linearize_seconds;
    }
}

std::vector<Vec3> forces_at_points(const NodeVector& forces, const OnLevel* level) {
  return to_points(level && forces.size() > 0 ? level->forces(forces) : forces);
}

Result state_of_cells(const MeshCells& cells, const ElasticCells& elastic, const NodeVector& u, CellMeasures measures,
                      const OnLevel* on_level, CellFields fields) {
  const Mesh& mesh = elastic.mesh();
  Result r = hexmesh::rest_state(cells.lattice(), cells.level());
  add_measures(measures, fields);
  add_energy(elastic, u, fields);
  if (!on_level) {
    r.cell_fields.merge(fields);
    r.displacement = to_points(u);
    return r;
  }
  std::vector<double>& level = fields["cell_level"];
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) level.push_back(cells.place(c).level);
  for (const auto& [name, values] : fields) r.cell_fields[name] = on_level->values(values);
  NodeVector of_level;
  on_level->tell(u, of_level);
  r.displacement = to_points(of_level);
  return r;
}

CellFields changing_fields(const ElasticCells& elastic, const NodeVector& u, const OnLevel* level) {
  CellMeasures measures = measure_cells(elastic, u);
  CellFields fields;
  add_measures(measures, fields);
  add_energy(elastic, u, fields);
  for (const char* constant : {"young_modulus", "poisson_ratio"}) fields.erase(constant);
  if (level)
    for (auto& [name, values] : fields) values = level->values(values);
  return fields;
}

std::vector<ContactReport> contact_reports(const LevelProblem& problem, const NodeVector& u) {
  std::vector<ContactReport> out;
  for (std::size_t c = 0; c < problem.contacts().size(); ++c) {
    const PenaltyContact::State state = problem.contacts()[c]->state(u);
    out.push_back({problem.scene().contacts[c].name, state.points, state.deepest, state.nearest, state.force,
                   Vec3::Zero(), state.slipping});
  }
  return out;
}

std::vector<Vec3> contact_forces(const LevelProblem& problem, const NodeVector& u, const OnLevel* level) {
  if (problem.contacts().empty()) return {};
  return forces_at_points(forces_of(problem.contacts(), problem.mesh(), u), level);
}

Outcome make_result(const Lattice& lattice, const LevelProblem& problem, const NodeVector& u, SolveReport report) {
  report.strain_energy_n_mm = problem.strain_energy(u);
  report.held_cells = problem.num_island_cells();
  report.held_force_n = problem.spring_force(u);
  if (report.held_cells > 0)
    report.warnings.push_back(fmt::format("{} cells are held by springs: nothing else holds them", report.held_cells));
  if (problem.is_carried())
    report.warnings.emplace_back("nothing but obstacles holds all or parts of the body: it rests where these stop it");
  report_conditions(lattice, problem, u, report);
  for (const Potential::Cost& cost : problem.potential().costs()) report.bytes.emplace_back(cost.name, cost.bytes);
  CellMeasures measures = measure_cells(problem.elastic(), u);
  report.pressure_checkerboard = measures.pressure_checkerboard;
  CellFields fields;
  add_prestretches(problem.prestretches(), fields);
  if (!problem.contacts().empty()) {
    constexpr double most_voxels = 12;  // nearer than any distance of a segment ends
    const double farthest = most_voxels * lattice.voxels.spacing().maxCoeff();
    const std::vector<TouchPoint> points = problem.touch_points(u);
    fields["contact_pressure"] = pressure_of_cells(problem.mesh(), points);
    fields["contact_gap"] = gap_of_cells(problem.mesh(), points, farthest);
  }
  if (!problem.islands().empty()) fields["island"] = {problem.islands().begin(), problem.islands().end()};
  const std::unique_ptr<const OnLevel> level = OnLevel::of(problem.cells(), problem.mesh());
  Result result =
      state_of_cells(problem.cells(), problem.elastic(), u, std::move(measures), level.get(), std::move(fields));
  add_surface_and_conditions(problem, u, level.get(), result);
  if (report.converged)
    if (const std::string limit = problem.elastic().limit_reached(u, false); !limit.empty())
      report.warnings.push_back(limit);
  report_changes(count_changes(result, 0, result.cells.size()), report);
  return {std::move(result), std::move(report)};
}

}  // namespace hexsolver
