// SPDX-License-Identifier: Apache-2.0
#include "scene/read_tables.h"

namespace hexsolver {
namespace {

/// Strain and law. Where a scene asks for neither, cells rotate only where that matters.
/// @returns whether it names a strain
bool read_law(TomlReader& table, Scene& scene) {
  const auto strain = table.choice<std::optional<Elasticity>>("strain", {{"cauchy", Elasticity::cauchy},
                                                                         {"linear", Elasticity::cauchy},
                                                                         {"corotational", Elasticity::corotational},
                                                                         {"green-lagrange", Elasticity::green_lagrange},
                                                                         {"auto", std::nullopt}});
  const auto law =
      table.choice<std::optional<Elasticity>>("law", {{"hooke", std::nullopt},
                                                      {"neo-hookean", Elasticity::neo_hookean},
                                                      {"stable-neo-hookean", Elasticity::stable_neo_hookean}});
  if (law && *law) {
    if (strain && *strain)
      table.fail_at("strain", "strain goes with law = \"hooke\", expected none or \"auto\": this law has its own");
    scene.elasticity = **law;
  } else if (strain) {
    scene.elasticity = strain->value_or(Elasticity::corotational);
    scene.finds_strain = !strain->has_value();
  } else {
    scene.finds_strain = true;
  }
  return strain.has_value();
}

/// Which levels are solved.
void read_levels(TomlReader& table, bool moves, Scene& scene) {
  scene.level = table.integer("level", 0, most_levels, "a level of the lattice, 0 or more");
  scene.accuracy = table.number("accuracy_mm", 1e-9, infinity, "an accuracy > 0 mm");
  scene.reaction_accuracy =
      table.number("accuracy_reactions", 1e-6, 1, "a part of the largest reaction, 1e-6 to 1 (0.05 is 5 %)");
  scene.budget = table.number("budget_s", 1e-3, infinity, "a time of 0.001 s or more");
  if (moves && scene.is_open_ended())
    table.fail_at(scene.accuracy ? "accuracy_mm"
                  : scene.budget ? "budget_s"
                                 : "accuracy_reactions",
                  "accuracy_mm, accuracy_reactions and budget_s go with kind = \"equilibrium\", expected level");
  if (scene.level.has_value() + scene.asks_accuracy() + scene.budget.has_value() > 1)
    table.fail_here("[solve] has more than one of level, budget_s and an accuracy, expected one");
}

}  // namespace

SolveTable read_solve(TomlReader table, Scene& scene) {
  SolveTable out;
  const bool moves = out.moves =
      table.choice<bool>("kind", {{"equilibrium", false}, {"dynamics", true}}).value_or(false);
  const bool says_strain = read_law(table, scene);
  if (auto v = table.choice<Rotation>("rotation", {{"polar", Rotation::polar}, {"edges", Rotation::edges}}))
    scene.rotation = *v;
  if (scene.rotation == Rotation::edges && !says_strain) scene.finds_strain = false;  // they rotate, all of them
  if (scene.rotation == Rotation::edges && scene.elasticity != Elasticity::corotational)
    table.fail_at("rotation",
                  "rotation = \"edges\" goes with strain = \"corotational\" alone, expected that or no edges");
  const auto volumetric =
      table.choice<Volumetric>("volumetric", {{"mean", Volumetric::mean}, {"full", Volumetric::full}});
  const bool green_lagrange = scene.elasticity == Elasticity::green_lagrange;
  scene.volumetric = volumetric.value_or(green_lagrange ? Volumetric::full : Volumetric::mean);
  if (green_lagrange && scene.volumetric == Volumetric::mean)
    table.fail_at("volumetric",
                  "volumetric = \"mean\" goes with other strains than \"green-lagrange\", expected \"full\"");
  if (auto v = table.choice<Stiffness>("stiffness", {{"exact", Stiffness::exact},
                                                     {"incompatible", Stiffness::incompatible},
                                                     {"condensed", Stiffness::condensed},
                                                     {"uniform", Stiffness::uniform}}))
    scene.stiffness = *v;
  if (scene.stiffness && is_of_matrices(*scene.stiffness) && is_hyperelastic(scene.elasticity))
    table.fail_at("stiffness",
                  "stiffness = \"incompatible\" and \"condensed\" go with strain = \"cauchy\", \"corotational\" or "
                  "\"auto\", expected one of them or \"exact\"");
  if (moves && scene.stiffness == Stiffness::condensed)
    table.fail_at("stiffness",
                  "stiffness = \"condensed\" goes with kind = \"equilibrium\": masses act on all that is inside cells, "
                  "expected \"exact\" or \"incompatible\"");
  if (moves && scene.finds_strain && scene.rotation == Rotation::edges)
    table.fail_at("rotation",
                  "rotation = \"edges\" does not go with strain = \"auto\" in a motion, expected one of them");
  read_levels(table, moves, scene);
  if (auto v = table.choice<Supports>(
          "supports", {{"area", Supports::area}, {"soft", Supports::soft}, {"points", Supports::points}}))
    scene.supports = *v;
  if (auto v = table.choice<Grading>("grading", {{"off", Grading::off}, {"scene", Grading::scene}})) scene.grading = *v;
  if (auto v = table.integer("coarser_by", 0, most_levels,
                             "how many levels coarser than the finest graded cells may be, 0 to 30")) {
    scene.coarser_by = *v;
    if (scene.grading == Grading::off)
      scene.warnings.emplace_back("solve.coarser_by goes with solve.grading = \"scene\": it changes nothing");
  }
  if (auto v = table.choice<ErrorEstimation>(
          "error_estimate",
          {{"auto", ErrorEstimation::automatic}, {"look", ErrorEstimation::look}, {"off", ErrorEstimation::off}}))
    scene.error_estimation = *v;
  const auto tolerance = table.number_unless("auto", "tolerance", 1e-13, 0.1, "1e-13 to 0.1, or \"auto\"");
  scene.finds_tolerance = !tolerance;
  scene.tolerance = tolerance.value_or(scene.tolerance);
  if (auto v = table.choice<Islands>("islands",
                                     {{"error", Islands::error}, {"drop", Islands::drop}, {"hold", Islands::hold}}))
    scene.islands = *v;
  if (auto v = table.choice<bool>("conflicts", {{"error", false}, {"compromise", true}})) scene.compromise = *v;
  out.is_loaded = table.choice<bool>("reference", {{"rest", false}, {"loaded", true}}).value_or(false);
  out.rest_method =
      table.choice<RestMethod>("inverse", {{"newton", RestMethod::newton}, {"fixed-point", RestMethod::fixed_point}});
  if (out.rest_method && !out.is_loaded)
    scene.warnings.emplace_back("solve.inverse goes with solve.reference = \"loaded\": it changes nothing");
  table.finish();
  return out;
}

Dynamics read_dynamics(TomlReader table, const std::filesystem::path& folder) {
  constexpr double most_seconds = 1e9, most_steps = 1e8;
  Dynamics d;
  const auto step = table.number("step_s", 1e-9, most_seconds, "a time of 1e-9 to 1e9 s");
  const auto duration = table.number("duration_s", 1e-9, most_seconds, "a time of 1e-9 to 1e9 s");
  if (auto v = table.integer("output_every", 1, 1000000000, "a number of steps, 1 to 1e9")) d.output_every = *v;
  if (auto v = table.choice<bool>("output_fields", {{"all", true}, {"end", false}})) d.fields_in_every_state = *v;
  if (auto v = table.choice<Integrator>("integrator",
                                        {{"implicit-euler", Integrator::implicit_euler}, {"bdf2", Integrator::bdf2}}))
    d.integrator = *v;
  if (auto v = table.choice<StepSolver>(
          "solver", {{"cg", StepSolver::cg}, {"jacobi", StepSolver::jacobi}, {"multigrid", StepSolver::multigrid}}))
    d.solver = *v;
  if (auto v = table.integer("solver_iterations", 0, 100000, "0 (as many as the tolerance takes) to 100000"))
    d.solver_iterations = *v;
  const auto newton = table.integer("newton_iterations", 0, 25, "0 (as many as the tolerance takes) to 25");
  d.newton_iterations = newton.value_or(d.solver_iterations > 0 ? 1 : 0);
  if (auto v = table.vector("velocity_mm_s", "three numbers [x, y, z], LPS, mm/s")) d.velocity = *v;
  const auto start = table.text("start", "the path of a .hexresult");
  table.finish();
  if (!step || !duration)
    table.fail_here(
        fmt::format("[dynamics] has no {}, expected step_s and duration_s", step ? "duration_s" : "step_s"));
  d.step = *step;
  d.duration = *duration;
  if (d.duration / d.step > most_steps)
    table.fail_at("step_s", fmt::format("duration_s / step_s is {:.3g} steps, expected at most {:g}",
                                        d.duration / d.step, most_steps));
  if (d.solver_iterations > 0 && d.newton_iterations == 0)
    table.fail_at("newton_iterations",
                  "newton_iterations = 0 solves to the tolerance, expected solver_iterations = 0 with it");
  if (start) {
    d.start = folder / *start;
    if (!std::filesystem::is_regular_file(d.start))
      table.fail_at("start", fmt::format("dynamics.start is '{}', expected a file (relative to the scene)", *start));
  }
  return d;
}

Damping read_damping(TomlReader table) {
  Damping d;
  d.mass_per_s = table.number("mass_per_s", 0, 1e12, "a rate in 1/s, 0 or more").value_or(0);
  d.stiffness_s = table.number("stiffness_s", 0, 1e6, "a time in s, 0 or more").value_or(0);
  table.finish();
  return d;
}

}  // namespace hexsolver
