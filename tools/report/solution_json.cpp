// SPDX-License-Identifier: Apache-2.0
#include "report/solution_json.h"

#include <algorithm>

#include "cli/machine.h"

namespace hextools {

using hexsolver::SolveReport;
using nlohmann::json;

double megabytes(std::size_t bytes) { return static_cast<double>(bytes) / (1 << 20); }

namespace {

json to_json(const std::optional<double>& value) { return value ? json(*value) : json(); }

json to_json(const hexmesh::Vec3& v) { return {v[0], v[1], v[2]}; }

const char* stiffness_name(hexsolver::Stiffness s) {
  switch (s) {
    case hexsolver::Stiffness::exact:
      return "exact";
    case hexsolver::Stiffness::incompatible:
      return "incompatible";
    case hexsolver::Stiffness::condensed:
      return "condensed";
    case hexsolver::Stiffness::uniform:
      return "uniform";
  }
  return "";
}

const char* supports_name(hexsolver::Supports s) {
  switch (s) {
    case hexsolver::Supports::area:
      return "area";
    case hexsolver::Supports::soft:
      return "soft";
    case hexsolver::Supports::points:
      return "points";
  }
  return "";
}

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
                   {"slipping", c.slipping},
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
                    {"friction_work_n_mm", r.friction_work},
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

/// Of a matrix.
json rows_of(const hexmesh::Mat3& m) {
  json out;
  for (int row = 0; row < 3; ++row) out.push_back(to_json(hexmesh::Vec3(m.row(row))));
  return out;
}

/// Where an obstacle is at the end.
Eigen::Isometry3d place_at_end(const hexsolver::Contact& c, const hexsolver::Scene& scene) {
  return hexsolver::place_of(c, {1, scene.dynamics ? scene.dynamics->duration : 0});
}

/// The table of a scene that has this obstacle.
void add_shape(const hexmesh::Solid& solid, json& row) {
  const auto bar = [](const auto& s) -> json {
    return {{"from_mm", to_json(s.from)}, {"to_mm", to_json(s.to)}, {"radius_mm", s.radius}};
  };
  if (const auto* plane = std::get_if<hexmesh::HalfSpace>(&solid))
    row["plane"] = {{"point_mm", to_json(plane->point)}, {"normal", to_json(plane->normal)}};
  else if (const auto* ball = std::get_if<hexmesh::Ball>(&solid))
    row["sphere"] = {{"center_mm", to_json(ball->center)}, {"radius_mm", ball->radius}};
  else if (const auto* capsule = std::get_if<hexmesh::Capsule>(&solid))
    row["capsule"] = bar(*capsule);
  else if (const auto* cylinder = std::get_if<hexmesh::Cylinder>(&solid))
    row["cylinder"] = bar(*cylinder);
  else if (const auto* block = std::get_if<hexmesh::Block>(&solid))
    row["box"] = {{"center_mm", to_json(block->center)},
                  {"size_mm", to_json(hexmesh::Vec3(2 * block->half))},
                  {"axis_x", to_json(hexmesh::Vec3(block->axes.col(0)))},
                  {"axis_y", to_json(hexmesh::Vec3(block->axes.col(1)))},
                  {"axis_z", to_json(hexmesh::Vec3(block->axes.col(2)))}};
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
    rows[n]["friction"] = c.friction;
    if (c.stiffness > 0) rows[n]["stiffness_n_mm"] = c.stiffness;
    if (c.self)
      rows[n]["self"] = c.self->empty() ? json(true) : json(*c.self);
    else if (c.between)
      rows[n]["between"] = {c.between->first, c.between->second};
    else if (c.file.empty())
      add_shape(hexmesh::placed(c.obstacle, place_at_end(c, scene)), rows[n]);
    else
      rows[n]["surface"] = c.file.filename().string();
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
  for (const hexsolver::Prestress& p : scene.prestresses)
    out["prestresses"].push_back(p.stretch ? json{{"segment", p.segment}, {"stretch", rows_of(*p.stretch)}}
                                           : json{{"segment", p.segment}, {"stress_kpa", rows_of(1e3 * *p.stress)}});
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
  if (scene.finds_tolerance)
    out["tolerance"] = "auto";
  else
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
  out["stiffness"] = stiffness_name(scene.stiffness_of_cells());
  out["supports"] = supports_name(scene.rule_of_supports());
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

json to_json(const hexsolver::SceneCheck& check) {
  json out = {{"level", check.level},
              {"conditions", json::array()},
              {"forces", to_json(check.forces)},
              {"contacts", to_json(check.contacts)},
              {"dropped_cells", check.dropped_cells},
              {"held_cells", check.held_cells},
              {"warnings", check.warnings}};
  for (const hexsolver::ConditionReport& c : check.conditions) out["conditions"].push_back(to_json(c));
  return out;
}

json preview_json(const hexsolver::SceneCheck& check, const hexsolver::Scene& scene) {
  json out = to_json(check);
  out["is_preview"] = true;
  add_scene(out, scene.loaded ? hexsolver::scene_at_end(scene) : scene);
  return out;
}

json to_json(const hexsolver::SolvePlan& plan) {
  json out = {{"effects", to_json(plan.effects)}, {"levels", json::array()}};
  add_effect_seconds(out["effects"], plan.effects);
  const auto of_level = [](const hexsolver::SolvePlan::Level& l) -> json {
    return {{"level", l.level},
            {"cells", l.cells},
            {"dofs", l.dofs},
            {"seconds", l.seconds},
            {"memory_mb", megabytes(l.bytes)}};
  };
  for (const hexsolver::SolvePlan::Level& l : plan.levels) out["levels"].push_back(of_level(l));
  if (plan.look) out["look"] = of_level(*plan.look);
  if (plan.end)
    out["end"] = {{"level", plan.end->level}, {"why", plan.end->why}, {"most_seconds", plan.end->most_seconds}};
  if (plan.finds_cells) out["finds_cells"] = true;
  out["reading_seconds"] = plan.reading_seconds;
  out["strain_seconds"] = plan.strain_seconds;
  out["setup_seconds"] = plan.setup_seconds;
  out["seconds"] = plan.seconds();
  out["memory_mb"] = megabytes(plan.bytes);
  return out;
}

}  // namespace hextools
