// SPDX-License-Identifier: Apache-2.0
#include "level_errors.h"

#include <fmt/format.h>

#include <cmath>

#include "experiments.h"
#include "hexmesh/core/error.h"
#include "hexsolver/equilibrium/equilibrium.h"
#include "statistics.h"

namespace hextools {

using hexmesh::Vec3;
using hexsolver::SolveReport;

int coarsest_level(const hexmesh::Lattice& lattice, std::size_t least_cells) {
  std::size_t level = 0;
  while (level + 1 < lattice.levels.size() && lattice.levels[level + 1].cells.size() >= least_cells) ++level;
  return static_cast<int>(level);
}

LevelErrorMeter::LevelErrorMeter(const hexmesh::Lattice& lattice, hexsolver::Scene scene)
    : lattice_(lattice), scene_(std::move(scene)), points_(material_points(lattice)) {
  scene_.name_level({});
  hexsolver::Scene finest = scene_;
  finest.error_estimation = hexsolver::ErrorEstimation::off;
  finest.grading = hexsolver::Grading::off;
  finest.finds_tolerance = false;
  const hexsolver::Outcome outcome = hexsolver::solve_equilibrium(lattice, finest, 0);
  if (!outcome.report.converged)
    throw hexmesh::Error(
        hexmesh::ErrorKind::geometry,
        fmt::format("level 0 is the measure of the others and did not converge: {}", outcome.report.reason));
  truth_ = displacement_at(outcome.result, points_);
  energy_ = outcome.report.strain_energy_n_mm;
  for (const hexsolver::ConditionReport& c : outcome.report.conditions) reactions_.push_back(c.reaction_n);
}

double LevelErrorMeter::mean_displacement() const {
  return distances(truth_, std::vector<Vec3>(truth_.size(), Vec3::Zero())).mean;
}

double LevelErrorMeter::largest_reaction() const {
  double largest = 0;
  for (const Vec3& r : reactions_) largest = std::max(largest, r.norm());
  return largest;
}

LevelErrors LevelErrorMeter::measure(const hexsolver::Scene& scene, int level) const {
  const hexsolver::Outcome outcome = hexsolver::solve_equilibrium(lattice_, scene, level);
  const SolveReport& report = outcome.report;
  const hexsolver::LevelReport& last = report.levels.back();
  LevelErrors row;
  row.level = last.level;
  row.cells = last.cells;
  row.unknowns = 3 * last.nodes;
  row.converged = report.converged;
  row.accuracy_missed = report.accuracy_missed;
  const Distances d = distances(displacement_at(outcome.result, points_), truth_);
  row.mean = {last.error.mean_mm, d.mean};
  row.largest = {last.error.max_mm, d.max};
  row.energy = {last.error.strain_energy_n_mm, std::abs(report.strain_energy_n_mm - energy_)};
  for (std::size_t c = 0; c < reactions_.size(); ++c)
    row.reactions.push_back({c < last.error.reactions_n.size() ? last.error.reactions_n[c] : std::nullopt,
                             (report.conditions[c].reaction_n - reactions_[c]).norm()});
  if (scene.finds_tolerance && row.converged && !scene.is_open_ended()) measure_equations(scene, outcome, row);
  return row;
}

void LevelErrorMeter::measure_equations(hexsolver::Scene scene, const hexsolver::Outcome& outcome,
                                        LevelErrors& row) const {
  scene.finds_tolerance = false;
  scene.tolerance = 1e-10;
  scene.error_estimation = hexsolver::ErrorEstimation::off;
  const hexsolver::Outcome sharp = hexsolver::solve_equilibrium(lattice_, scene, row.level);
  if (!sharp.report.converged) return;
  row.equations = {outcome.report.levels.back().error.algebraic_mm,
                   distances(displacement_at(outcome.result, points_), displacement_at(sharp.result, points_)).mean};
  for (std::size_t c = 0; c < reactions_.size(); ++c)
    row.reactions_of_equations.push_back(
        (outcome.report.conditions[c].reaction_n - sharp.report.conditions[c].reaction_n).norm());
}

LevelErrors LevelErrorMeter::of_level(int level) const { return measure(scene_, level); }

LevelErrors LevelErrorMeter::of_accuracy(double accuracy) const {
  hexsolver::Scene scene = scene_;
  scene.accuracy = accuracy;
  return measure(scene, 0);
}

}  // namespace hextools
