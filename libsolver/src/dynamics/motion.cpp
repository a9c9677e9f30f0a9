// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/dynamics/motion.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/stopwatch.h"
#include "dynamics/time_integrator.h"
#include "level/checks.h"
#include "level/islands.h"
#include "level/make_result.h"
#include "mesh/points.h"

namespace hexsolver {

using hexmesh::Lattice;

Motion::Motion(const Lattice& lattice, const Scene& scene, int level)
    : integrator_(std::make_unique<TimeIntegrator>(lattice, scene, level)) {}
Motion::~Motion() = default;

bool Motion::step() { return integrator_->step(); }
const char* Motion::reason() const { return integrator_->reason(); }
double Motion::time() const { return integrator_->time(); }
const NodeVector& Motion::displacement() const { return on_level(integrator_->displacement(), displacement_); }
const NodeVector& Motion::velocity() const { return on_level(integrator_->velocity(), velocity_); }
const NodeVector& Motion::on_level(const NodeVector& field, NodeVector& told) const {
  const OnLevel* level = integrator_->on_level();
  if (!level) return field;
  level->tell(field, told);
  return told;
}
const Energies& Motion::energies() const { return integrator_->energies(); }
double Motion::work() const { return integrator_->work(); }
double Motion::work_uncertainty() const { return integrator_->work_uncertainty(); }
double Motion::friction_work() const { return integrator_->friction_work(); }
Vec3 Motion::momentum() const { return integrator_->momentum(); }
const Mesh& Motion::mesh() const { return integrator_->problem().mesh(); }
hexmesh::CellLocator Motion::locator() const {
  const hexmesh::Lattice& lattice = integrator_->lattice();
  const hexmesh::Level& level = lattice.level(integrator_->problem().level());
  return {lattice.voxels, level.voxels_per_cell, level.cells, level.split.owners};
}
const std::vector<hexmesh::CellNodes>& Motion::cell_nodes() const {
  return integrator_->on_level() ? integrator_->on_level()->numbering().cell_nodes : mesh().cell_nodes();
}
void Motion::set_state(const NodeVector& u, const NodeVector& v) {
  const OnLevel* level = integrator_->on_level();
  if (level)
    integrator_->set_state(level->sampled(u), level->sampled(v));
  else
    integrator_->set_state(u, v);
}
hexmesh::MotionStep Motion::state() const {
  const LevelProblem& problem = integrator_->problem();
  const NodeVector& u = integrator_->displacement();
  hexmesh::MotionStep out{to_points(displacement()), to_points(velocity()),
                          contact_forces(problem, u, integrator_->on_level())};
  if (problem.scene().dynamics->fields_in_every_state)
    out.cell_fields = changing_fields(problem.elastic(), u, integrator_->on_level());
  return out;
}
bool Motion::grab(std::size_t point, const Vec3& place, double reach) { return integrator_->grab(point, place, reach); }
void Motion::let_go(std::optional<std::size_t> point) { integrator_->let_go(point); }
const Motion::Counts& Motion::counts() const { return integrator_->counts(); }
std::vector<ContactReport> Motion::contacts() const {
  return contact_reports(integrator_->problem(), integrator_->displacement());
}
const std::string* Motion::ball_inside() const { return integrator_->ball_inside(); }

void Motion::explain(std::vector<Effect>& effects) const {
  if (integrator_->problem().grabs())
    effects.push_back(
        {EffectKind::grab, name_of(EffectKind::grab), true, "points of the surface were held from outside"});
  if (!integrator_->rotations().finds()) return;
  const std::optional<double> since = integrator_->rotations().since();
  for (Effect& e : effects)
    if (e.kind == EffectKind::rotation) {
      e.active = since.has_value();
      e.why += since ? fmt::format("; they did from {:.6g} s on", *since) : "; none had to";
    }
}

std::vector<std::string> Motion::check() const { return integrator_->check(); }

Outcome Motion::make_result(SolveReport report) const {
  if (report.levels.empty()) report.levels.emplace_back();
  integrator_->be_at_rest_if_failed();
  const LevelProblem& problem = integrator_->problem();
  report.bytes = {{"lattice", hexmesh::bytes_of(integrator_->lattice())},
                  {"meshes", problem.hierarchy().bytes()},
                  {"supports", problem.constraints().bytes()},
                  {"multigrid", integrator_->preconditioner_bytes()}};
  add_effect_seconds(problem.potential(), report);
  Outcome outcome =
      hexsolver::make_result(integrator_->lattice(), problem, integrator_->displacement(), std::move(report));
  outcome.result.velocity = to_points(velocity());
  return outcome;
}

namespace {

/// Gains of energy without work above this are told.
constexpr double gain_to_tell = 1e-8;

MotionReport::Row row_of(const Motion& motion) {
  return {motion.time(),          motion.energies(), motion.work(),    motion.work_uncertainty(),
          motion.friction_work(), motion.momentum(), motion.contacts()};
}

/// How a motion went, and why it ended.
/// @param ends  whether it was asked to
/// @param ball  an obstacle that has gone through the surface; may be null
void report_motion(const Motion& motion, const Dynamics& settings, bool ends, const std::string* ball,
                   SolveReport& report) {
  MotionReport& of_motion = *report.motion;

  const Motion::Counts& counts = motion.counts();
  of_motion.steps = counts.steps - (!report.converged && !report.interrupted);
  of_motion.substeps = counts.substeps;
  of_motion.failed_substeps = counts.failed;
  of_motion.largest_gain = counts.largest_gain;
  if (counts.largest_gain > gain_to_tell)
    report.warnings.push_back(
        fmt::format("in the smallest substeps the body gained up to {:.1g} of its energy "
                    "without work: it snapped through, or step_s is too large",
                    counts.largest_gain));
  of_motion.slowed_substeps = counts.slowed;
  of_motion.largest_residual = counts.largest_residual;
  constexpr double much = 0.1;
  if (ball)
    report.reason = fmt::format(
        "at {:.6g} s the ball of contact '{}' is inside the body: it went through the surface; a larger "
        "stiffness_n_mm holds it off",
        motion.time(), *ball);
  else if (report.interrupted)
    report.reason = fmt::format("interrupted at {:.6g} of {:.6g} s", motion.time(), settings.duration);
  else if (!report.converged)
    report.reason = fmt::format("stopped at {:.6g} s: {}", motion.time(), motion.reason());
  else if (ends)
    report.reason = fmt::format("ended as asked at {:.6g} of {:.6g} s", motion.time(), settings.duration);
  else if (settings.newton_iterations == 0)
    report.reason = "all steps were solved to the tolerance";
  else
    report.reason = "all steps were taken, with the iterations asked";
  if (counts.largest_residual > much)
    report.warnings.push_back(
        fmt::format("residuals of up to {:.2g} are left by {} iterations a step: the motion is "
                    "slower than it should be",
                    counts.largest_residual, settings.solver_iterations));
  if (counts.slowed > 0)
    report.warnings.push_back(
        fmt::format("{} substeps were slowed down, which takes momentum away: smaller steps or more iterations keep it",
                    counts.slowed));
  if (counts.let_go > 0)
    report.warnings.push_back(
        fmt::format("grabbed points were let go {} times: no step could be solved with them", counts.let_go));
  if (counts.held > 0)
    report.warnings.push_back(fmt::format(
        "up to {} cells were nearly inside out and kept their rotation over a step, without which it had no "
        "solution: there the motion has no meaning",
        counts.held));
  report.load_fraction = std::min(1.0, motion.time() / settings.duration);
  report.relative_residual = counts.relative_residual;
}

}  // namespace

Outcome solve_dynamics(const Lattice& whole, const Scene& scene, int level,
                       const std::function<void(const Motion&)>& on_output,
                       const std::function<void(const Motion&)>& on_step,
                       const std::function<NextStep(Motion&)>& next_step) {
  SolveReport report;
  report.warnings = check_single_points(scene);
  check_contrast(whole);
  report.effects = list_effects(scene);
  report.elasticity = scene.elasticity;
  const Stopwatch setup;
  const std::optional<Lattice> rest = without_islands(whole, scene, level, report.dropped_cells);
  const Lattice& lattice = rest ? *rest : whole;
  if (rest) warn_of_dropped_cells(whole, level, report);
  Motion motion(lattice, scene, level);
  const std::vector<std::string> warnings = motion.check();
  report.warnings.insert(report.warnings.end(), warnings.begin(), warnings.end());
  report.setup_seconds = setup.seconds();

  MotionReport& of_motion = report.motion.emplace();
  const auto output = [&] {
    of_motion.rows.push_back(row_of(motion));
    if (on_output) on_output(motion);
  };
  const Dynamics& settings = *scene.dynamics;
  const int steps = settings.num_steps();
  const Stopwatch solve;
  output();
  report.converged = true;
  const std::string* ball = nullptr;
  bool ends = false;
  for (int n = 1; n <= steps && report.converged && !ends; ++n) {
    const NextStep next = next_step ? next_step(motion) : NextStep::take;
    ends = next == NextStep::end;
    report.interrupted = next == NextStep::interrupt;
    report.converged = !report.interrupted && (ends || motion.step());
    if (report.converged && !ends && on_step) on_step(motion);
    const bool is_output = n % settings.output_every == 0 || n == steps || ends || !report.converged;
    if (is_output && motion.time() > of_motion.rows.back().time) output();
    if (is_output && report.converged) ball = motion.ball_inside();
    report.converged = report.converged && !ball;
  }
  report.solve_seconds = solve.seconds();
  report_motion(motion, settings, ends, ball, report);
  motion.explain(report.effects);
  const Motion::Counts& counts = motion.counts();
  NewtonReport newton;
  newton.converged = report.converged;
  newton.reason = report.reason;
  newton.iterations = counts.newton;
  newton.linear_iterations = counts.linear;
  newton.relative_residual = counts.relative_residual;
  report.levels.push_back(
      {level, motion.mesh().num_cells(), motion.mesh().num_nodes(), report.solve_seconds, newton, {}});
  Outcome outcome = motion.make_result(std::move(report));
  outcome.result.labels = whole.labels;  // with the islands that were left out
  return outcome;
}

}  // namespace hexsolver
