// SPDX-License-Identifier: Apache-2.0
#include "cli/solve_report.h"

#include <fmt/format.h>

#include <algorithm>

namespace hextools {

using hexsolver::SolveReport;

hexsolver::SolveProgress progress_on(const Console& console, SolveWork work) {
  return [&console, work = std::move(work)](int number, double load, int step, double residual, int linear) {
    console.progress(fmt::format("level {}, load {:.3g}, Newton step {}: residual {:.2e}, {} linear iterations", number,
                                 load, step, residual, linear),
                     part_done(work, number, load, residual));
  };
}

std::string what_is_kept(const SolveReport& r, const std::string& output) {
  if (r.interrupted)
    return fmt::format("; '{}' holds the motion so far, marked so: dynamics.start goes on from it", output);
  return fmt::format("; '{}' holds {}, marked so", output,
                     r.load_fraction > 0 ? "the last state that did" : "the state at the start");
}

namespace {

void summarize_motion(const SolveReport& r, const Console& console) {
  const hexsolver::LevelReport& l = r.levels.back();
  const hexsolver::MotionReport& m = *r.motion;
  console.note(fmt::format(
      "level {}: {} cells, {} dofs, {} steps to {:.6g} s in {:.2f} s, {:.4g} steps/s, {} Newton steps, {} linear "
      "iterations, residuals up to {:.1e}",
      l.level, l.cells, 3 * l.nodes, m.steps, m.rows.back().time, r.solve_seconds,
      m.steps / std::max(r.solve_seconds, 1e-9), l.newton.iterations, l.newton.linear_iterations, m.largest_residual));
  if (m.failed_substeps > 0)
    console.note(
        fmt::format("{} substeps were not accepted and halved; {} were solved", m.failed_substeps, m.substeps));
  const hexsolver::Energies& e = m.rows.back().energies;
  console.note(
      fmt::format("at the end: kinetic energy {:.4g} N mm, strain {:.4g}, contact {:.4g}, of loads {:.4g}; "
                  "work done on the body {:.4g}",
                  e.kinetic, e.strain, e.contact, e.loads, m.rows.back().work));
}

/// Why nothing is known of the error of the last level.
const char* why_unknown(const SolveReport& r) {
  const auto looks = std::find_if(r.effects.begin(), r.effects.end(), [](const hexsolver::Effect& e) {
    return e.kind == hexsolver::EffectKind::error_estimate;
  });
  if (!r.converged) return "not converged";
  if (looks != r.effects.end() && looks->seconds == 0)
    return "no finer level was looked at (solve.error_estimate says when one is)";
  if (r.levels.back().error.is_hidden)
    return "cells average over layers of different stiffness that are thinner than those of the next finer level, or "
           "gaps end in them where they end in those";
  return "the levels do not come closer to each other";
}

}  // namespace

void summarize(const SolveReport& r, const Console& console) {
  const hexsolver::LevelReport& l = r.levels.back();
  if (r.loaded) {
    const hexsolver::NewtonReport& newton = r.loaded->scan->levels.back().newton;
    console.note(fmt::format(
        "without load the body is {:.3g} mm from what the lattice shows in the mean, {:.3g} mm at most "
        "(smallest Jacobian from there {:.3g}): {} Newton steps, {} linear iterations, {:.2f} s in all levels",
        r.loaded->mean_mm, r.loaded->largest_mm, r.loaded->scan->min_jacobian, newton.iterations,
        newton.linear_iterations, r.loaded->scan->solve_seconds));
  }
  if (r.motion)
    summarize_motion(r, console);
  else
    console.note(
        fmt::format("level {}: {} cells, {} dofs, {} Newton steps, {} linear iterations, residual {:.1e}, "
                    "{:.2f} s in all levels",
                    l.level, l.cells, 3 * l.nodes, l.newton.iterations, l.newton.linear_iterations, r.relative_residual,
                    r.solve_seconds));
  for (const hexsolver::ConditionReport& c : r.conditions)
    console.note(fmt::format("condition '{}': {} points, misfit {:.2g} mm, reaction [{:.4g}, {:.4g}, {:.4g}] N", c.name,
                             c.points, c.misfit_mm, c.reaction_n[0], c.reaction_n[1], c.reaction_n[2]));
  for (const hexsolver::ContactReport& c : r.contacts)
    console.note(fmt::format("contact '{}': {} points touch, {:.2g} mm deep, force [{:.4g}, {:.4g}, {:.4g}] N", c.name,
                             c.points, c.deepest_mm, c.force_n[0], c.force_n[1], c.force_n[2]));
  for (const hexsolver::MatchReport& m : r.matches)
    console.note(fmt::format(
        "match '{}': {} points{}, off by {:.3g} mm in the mean, 95 % below {:.3g} mm, largest {:.3g} mm; {} "
        "{:.3g} mm in the mean",
        m.name, m.points, m.is_part ? " of a part of the surface" : "", m.distance.mean_mm, m.distance.percentile95_mm,
        m.distance.largest_mm, r.pose ? "before, where a rigid motion puts the body," : "at rest", m.at_start.mean_mm));
  if (const hexsolver::ErrorEstimate& e = l.error; e.mean_mm)
    console.note(fmt::format(
        "estimated error of the cells' size: mean {:.2g} mm, largest {}; of the equations: {:.1g} mm", *e.mean_mm,
        e.max_mm ? fmt::format("{:.2g} mm", *e.max_mm) : "unknown", e.algebraic_mm.value_or(0)));
  else if (!r.motion)
    console.note(fmt::format("the error of the cells' size is unknown: {}", why_unknown(r)));
  console.note(fmt::format("strain energy {:.6g} N mm, smallest Jacobian {:.3g}, {} inverted voxels, volume {:+.2g} %",
                           r.strain_energy_n_mm, r.min_jacobian, r.inverted_voxels, 100 * r.volume_change));
}

}  // namespace hextools
