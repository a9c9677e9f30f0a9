// SPDX-License-Identifier: Apache-2.0
#include "cli/solve_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace hextools {

using hexsolver::SolveReport;
using nlohmann::json;

double megabytes(std::size_t bytes) { return static_cast<double>(bytes) / (1 << 20); }

namespace {

json to_json(const std::optional<double>& value) { return value ? json(*value) : json(); }

json to_json(const hexmesh::Vec3& v) { return {v[0], v[1], v[2]}; }

}  // namespace

json to_json(const hexsolver::ConditionReport& c) { return {{"name", c.name}, {"points", c.points}, {"kept", c.kept}}; }

json to_json(const std::vector<hexsolver::ForceReport>& forces) {
  json out = json::array();
  for (const hexsolver::ForceReport& f : forces) out.push_back({{"name", f.name}, {"total_n", to_json(f.total_n)}});
  return out;
}

json to_json(const std::vector<hexsolver::ContactReport>& contacts) {
  json out = json::array();
  for (const hexsolver::ContactReport& c : contacts)
    out.push_back({{"name", c.name},
                   {"points", c.points},
                   {"deepest_mm", c.deepest_mm},
                   {"nearest_mm", c.nearest_mm},
                   {"force_n", to_json(c.force_n)}});
  return out;
}

namespace {

json to_json(const hexsolver::DistanceReport& d) {
  return {{"mean_mm", d.mean_mm}, {"percentile95_mm", d.percentile95_mm}, {"largest_mm", d.largest_mm}};
}

}  // namespace

json to_json(const std::vector<hexsolver::MatchReport>& matches) {
  json out = json::array();
  for (const hexsolver::MatchReport& m : matches)
    out.push_back({{"name", m.name},
                   {"points", m.points},
                   {"trust_mm", m.trust_mm},
                   {"eased_points", m.eased_points},
                   {"part", m.is_part},
                   {"left_out", m.left_out},
                   {"unreached", m.unreached},
                   {"uncovered", m.uncovered},
                   {"kept_mean_mm", m.kept_mean_mm},
                   {"at_start", to_json(m.at_start)},
                   {"distance", to_json(m.distance)},
                   {"target_to_body", to_json(m.target_to_body)},
                   {"body_to_target", m.body_to_target ? to_json(*m.body_to_target) : json()},
                   {"force_n", to_json(m.force_n)}});
  return out;
}

namespace {

/// Before a solution there are none.
template <class Report>
void add_moments(const std::vector<Report>& from, json& rows) {
  for (std::size_t n = 0; n < from.size(); ++n) rows[n]["moment_n_mm"] = to_json(from[n].moment_n_mm);
}

json to_json(const hexsolver::BalanceReport& balance) {
  const auto row = [](const hexsolver::BalanceReport::Row& r) -> json {
    return {{"name", r.name}, {"force_n", to_json(r.force_n)}, {"moment_n_mm", to_json(r.moment_n_mm)}};
  };
  json acting = json::array();
  for (const hexsolver::BalanceReport::Row& r : balance.acting) acting.push_back(row(r));
  const hexsolver::BalanceReport::Row sum = balance.sum();
  return {{"about_mm", to_json(balance.about_mm)},
          {"acting", acting},
          {"sum", {{"force_n", to_json(sum.force_n)}, {"moment_n_mm", to_json(sum.moment_n_mm)}}}};
}

json to_json(const hexsolver::MotionReport& motion) {
  json rows = json::array();
  for (const hexsolver::MotionReport::Row& r : motion.rows)
    rows.push_back({{"time_s", r.time},
                    {"kinetic_n_mm", r.energies.kinetic},
                    {"strain_n_mm", r.energies.strain},
                    {"contact_n_mm", r.energies.contact},
                    {"loads_n_mm", r.energies.loads},
                    {"work_n_mm", r.work},
                    {"work_uncertainty_n_mm", r.work_uncertainty},
                    {"momentum_n_s", to_json(r.momentum)},
                    {"contacts", hextools::to_json(r.contacts)}});
  return {{"steps", motion.steps},
          {"substeps", motion.substeps},
          {"failed_substeps", motion.failed_substeps},
          {"slowed_substeps", motion.slowed_substeps},
          {"largest_residual", motion.largest_residual},
          {"largest_energy_gain", motion.largest_gain},
          {"rows", rows}};
}

}  // namespace

json to_json(const std::vector<hexsolver::Effect>& effects) {
  json out = json::array();
  for (const hexsolver::Effect& e : effects) out.push_back({{"name", e.name}, {"active", e.active}, {"why", e.why}});
  return out;
}

namespace {

json to_json(const hexsolver::ErrorEstimate& e) {
  return {{"mean", to_json(e.mean_mm)}, {"max", to_json(e.max_mm)}, {"algebraic", to_json(e.algebraic_mm)}};
}

/// Laws of large strain have a measure of their own.
const char* strain_name(hexsolver::Elasticity e) {
  switch (e) {
    case hexsolver::Elasticity::cauchy:
      return "cauchy";
    case hexsolver::Elasticity::corotational:
      return "corotational";
    case hexsolver::Elasticity::green_lagrange:
      return "green-lagrange";
    default:
      return "of the law";
  }
}

const char* law_name(hexsolver::Elasticity e) {
  if (e == hexsolver::Elasticity::neo_hookean) return "neo-hookean";
  return e == hexsolver::Elasticity::stable_neo_hookean ? "stable-neo-hookean" : "hooke";
}

}  // namespace

void add_scene(json& report, const hexsolver::Scene& scene) {
  for (std::size_t n = 0; n < scene.conditions.size() && n < report["conditions"].size(); ++n) {
    const hexsolver::Condition& c = scene.conditions[n];
    report["conditions"][n]["moves"] = c.by != hexmesh::Vec3::Zero() || c.turn || c.history;
  }
  json& rows = report["contacts"];
  for (std::size_t n = 0; n < scene.contacts.size() && n < rows.size(); ++n) {
    const hexsolver::Contact& c = scene.contacts[n];
    const hexmesh::Vec3 moved =
        c.history ? c.history->at(scene.dynamics ? scene.dynamics->duration : 0) : hexmesh::Vec3(c.by);
    if (const auto* plane = std::get_if<hexsolver::HalfSpace>(&c.obstacle))
      rows[n]["plane"] = {{"point_mm", to_json(hexmesh::Vec3(plane->point + moved))},
                          {"normal", to_json(plane->normal)}};
    else if (const auto* ball = std::get_if<hexsolver::Ball>(&c.obstacle))
      rows[n]["sphere"] = {{"center_mm", to_json(hexmesh::Vec3(ball->center + moved))}, {"radius_mm", ball->radius}};
  }
}

json to_json(const SolveReport& r, const hexsolver::Scene& as_written) {
  const hexsolver::Scene scene = r.loaded ? hexsolver::scene_at_end(as_written) : as_written;
  json out;
  out["kind"] = r.motion ? "dynamics" : "equilibrium";
  if (r.motion) out["motion"] = to_json(*r.motion);
  out["converged"] = r.converged;
  out["reason"] = r.reason;
  const hexsolver::NewtonReport& last = r.levels.back().newton;
  out["newton_iterations"] = last.iterations;
  out["linear_iterations"] = last.linear_iterations;
  out["relative_residual"] = r.relative_residual;
  out["load_fraction"] = r.load_fraction;
  out["constraint_violation_mm"] = r.constraint_violation_mm;
  out["kept_directions"] = r.kept_directions;
  out["conditions"] = json::array();
  const hexsolver::ErrorEstimate& error = r.levels.back().error;
  for (const hexsolver::ConditionReport& c : r.conditions) {
    const std::size_t number = out["conditions"].size();
    json condition = to_json(c);
    if (!r.motion)
      condition["reaction_error_n"] =
          number < error.reactions_n.size() ? to_json(error.reactions_n[number]) : json(nullptr);
    condition["misfit_mm"] = c.misfit_mm;
    condition["reaction_n"] = to_json(c.reaction_n);
    out["conditions"].push_back(condition);
  }
  add_moments(r.conditions, out["conditions"]);
  out["forces"] = to_json(r.forces);
  add_moments(r.forces, out["forces"]);
  out["contacts"] = to_json(r.contacts);
  add_moments(r.contacts, out["contacts"]);
  add_scene(out, scene);
  out["matches"] = to_json(r.matches);
  add_moments(r.matches, out["matches"]);
  if (r.pose)
    for (int row = 0; row < 3; ++row) {
      const Eigen::Vector4d v = r.pose->matrix().row(row);
      out["pose"].push_back({v[0], v[1], v[2], v[3]});
    }
  out["balance"] = to_json(r.balance);
  out["free_modes"] = json::array();
  out["dropped_cells"] = r.dropped_cells;
  out["held_cells"] = r.held_cells;
  out["held_force_n"] = to_json(r.held_force_n);
  out["accuracy_missed"] = r.accuracy_missed;
  out["tolerance"] = scene.tolerance;
  out["rotation"] = scene.rotation == hexsolver::Rotation::polar ? "polar" : "edges";
  out["effects"] = to_json(r.effects);
  out["warnings"] = r.warnings;
  out["error_estimate_mm"] = to_json(r.levels.back().error);
  out["strain_energy_n_mm"] = r.strain_energy_n_mm;
  if (!r.motion) out["reactions_error"] = to_json(error.of_reactions);
  if (!r.motion) out["strain_energy_error_n_mm"] = to_json(error.strain_energy_n_mm);
  out["min_jacobian"] = r.min_jacobian;
  out["inverted_cells"] = r.inverted_cells;
  out["inverted_voxels"] = r.inverted_voxels;
  out["volume_change"] = r.volume_change;
  out["least_volume_ratio"] = r.least_volume_ratio;
  out["largest_volume_ratio"] = r.largest_volume_ratio;
  out["strain"] = strain_name(r.elasticity);
  out["law"] = law_name(r.elasticity);
  out["pressure_checkerboard_kpa"] = 1e3 * r.pressure_checkerboard;
  out["stiffness"] = scene.stiffness == hexsolver::Stiffness::exact ? "exact" : "uniform";
  out["volumetric"] = scene.volumetric == hexsolver::Volumetric::mean ? "mean" : "full";
  for (const hexsolver::LevelReport& l : r.levels)
    out["levels"].push_back({{"level", l.level},
                             {"cells", l.cells},
                             {"dofs", 3 * l.nodes},
                             {"newton_iterations", l.newton.iterations},
                             {"linear_iterations", l.newton.linear_iterations},
                             {"relative_residual", l.newton.relative_residual},
                             {"converged", l.newton.converged},
                             {"error_mm", to_json(l.error)}});
  const hexsolver::LevelReport& finest = r.levels.back();
  out["lattice"] = {
      {"level", finest.level}, {"cells", finest.cells}, {"nodes", finest.nodes}, {"dofs", 3 * finest.nodes}};
  if (r.loaded) {
    out["loaded"] = to_json(*r.loaded->scan, hexsolver::loaded_scene(scene));
    out["loaded"]["rest_displacement_mm"] = {{"mean", r.loaded->mean_mm}, {"max", r.loaded->largest_mm}};
  }
  return out;
}

void add_effect_seconds(json& effects, const std::vector<hexsolver::Effect>& from) {
  for (std::size_t n = 0; n < from.size(); ++n) effects[n]["seconds"] = from[n].seconds;
}

namespace {

json to_json(const hexsolver::NewtonSeconds& s) {
  return {{"forces", s.forces},
          {"linearize", s.linearize},
          {"multigrid_set_up", s.set_up},
          {"multigrid_cycles", s.cycles},
          {"products", s.products}};
}

}  // namespace

json costs_of(const SolveReport& r, double read_seconds) {
  json out;
  for (const hexsolver::LevelReport& l : r.levels) out["levels"].push_back(l.seconds);
  for (const hexsolver::Effect& e : r.effects) out["effects"].push_back(e.seconds);
  out["seconds"] = {{"read", read_seconds}, {"setup", r.setup_seconds}, {"solve", r.solve_seconds}};
  out["peak_memory_mb"] = peak_memory_mb();
  return out;
}

void add_costs(json& out, const SolveReport& r) {
  for (std::size_t n = 0; n < r.levels.size(); ++n) {
    out["levels"][n]["seconds"] = r.levels[n].seconds;
    if (!r.motion) out["levels"][n]["seconds_of"] = to_json(r.levels[n].newton.seconds);
  }
  add_effect_seconds(out["effects"], r.effects);
  for (const auto& [what, bytes] : r.bytes) out["memory_mb"][what] = megabytes(bytes);
  out["peak_memory_mb"] = peak_memory_mb();
  if (r.loaded) add_costs(out["loaded"], *r.loaded->scan);
  if (r.motion) out["steps_per_second"] = r.motion->steps / std::max(r.solve_seconds, 1e-9);
}

namespace {

/// The share of a solution that is done, by cells: all of the coarser levels, and of this one as far as the residual
/// has fallen. Nothing where that is not known, and of a finer level that is only looked at.
std::optional<double> part_done(const SolveWork& work, int level, double load, double residual) {
  if (work.cells.empty() || level < work.finest || !std::isfinite(residual)) return {};
  const double fallen = std::clamp(std::log(residual) / std::log(work.tolerance), 0.0, 1.0);
  double done = 0, all = 0;
  for (int n = work.finest; n < std::ssize(work.cells); ++n) {
    const auto cells = static_cast<double>(work.cells[static_cast<std::size_t>(n)]);
    all += cells;
    if (n > level) done += cells;
    if (n == level) done += cells * load * fallen;
  }
  return done / all;
}

}  // namespace

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
    return "cells average over layers of different stiffness that are thinner than those of the next finer level";
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
