// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/plan/plan.h"

#include <algorithm>
#include <cmath>

#include "core/stopwatch.h"
#include "hexsolver/dynamics/motion.h"
#include "kernels/rotated_cells.h"
#include "level/checks.h"
#include "level/coarser_levels.h"
#include "level/condition_reports.h"
#include "level/islands.h"

namespace hexsolver {
namespace {

/// Operator products that the time of a level is worth, and memory per cell, as measured (THEORY.md, "Accuracy").
struct UsualCost {
  double products;
  double bytes_per_cell;
};
constexpr UsualCost linear_cost = {280, 900}, corotational_cost = {420, 2100}, hyperelastic_cost = {750, 3000};
constexpr double pressures_per_cell = 430;
constexpr double saved_per_cell = sizeof(RotatedCells<double>) / double(RotatedCells<double>::lanes);

bool needs_braess_sarazin(const hexmesh::Lattice& lattice, const Scene& scene) {
  double largest = 0;
  for (const hexmesh::VoxelMaterial& m : lattice.materials)
    largest = std::max(largest, m.material.bulk_modulus() / m.material.shear_modulus());
  return scene.volumetric == Volumetric::mean && !is_hyperelastic(scene.elasticity) &&
         Multigrid::needs_braess_sarazin(largest);
}

/// Linear iterations take more time in nearly incompressible material: 2.5 times from nu = 0.3 to 0.49, or 1.7 times
/// where the Braess-Sarazin smoother has pressures.
double growth_with_poisson(const hexmesh::Lattice& lattice, const Scene& scene) {
  double largest = 0.3;
  for (const hexmesh::VoxelMaterial& m : lattice.materials) largest = std::max(largest, m.material.poisson);
  return (needs_braess_sarazin(lattice, scene) ? 0.7 : 1) * std::pow(0.4 / (1 - 2 * largest), 0.3);
}

const UsualCost& usual_cost(Elasticity elasticity) {
  if (is_hyperelastic(elasticity)) return hyperelastic_cost;
  return elasticity == Elasticity::cauchy ? linear_cost : corotational_cost;
}

bool has_frames(const Scene& scene) {
  return scene.elasticity == Elasticity::corotational && scene.rotation == Rotation::polar;
}

template <class F>
double median_seconds(int repeats, F&& f) {
  std::vector<double> seconds;
  for (int n = 0; n < repeats; ++n) {
    const Stopwatch watch;
    f();
    seconds.push_back(watch.seconds());
  }
  std::nth_element(seconds.begin(), seconds.begin() + repeats / 2, seconds.end());
  return seconds[static_cast<std::size_t>(repeats / 2)];
}

/// Of an operator product, on the finest of the levels `first` to `last` that is still quick to make.
double seconds_per_cell(const hexmesh::Lattice& lattice, const Scene& scene, int first, int last) {
  constexpr std::size_t most_cells = 20000;
  int number = first;
  while (number > last && lattice.levels[static_cast<std::size_t>(number) - 1].cells.size() <= most_cells) --number;
  LevelProblem problem(lattice, number == last ? scene : for_coarser_levels(scene), number);
  problem.build_potential(scene.elasticity);
  const NodeVector x = NodeVector::Ones(static_cast<Eigen::Index>(problem.mesh().num_dofs()));
  NodeVector y;
  problem.potential().linearize(NodeVector::Zero(x.size()), Hessian::exact);
  return median_seconds(11, [&] { problem.potential().apply(x, y); }) / static_cast<double>(problem.mesh().num_cells());
}

}  // namespace

SceneCheck check_scene(const hexmesh::Lattice& whole, const Scene& scene, int level) {
  SceneCheck check;
  check.level = level;
  check.warnings = check_single_points(scene);
  check_contrast(whole);
  check_open_ended(scene, cells_of_levels(whole), level);
  const std::optional<hexmesh::Lattice> rest = without_islands(whole, scene, level, check.dropped_cells);
  const LevelProblem problem(rest ? *rest : whole, scene, level);
  if (scene.dynamics) {
    const std::vector<std::string> at_times = Motion(rest ? *rest : whole, scene, level).check();
    check.warnings.insert(check.warnings.end(), at_times.begin(), at_times.end());
  } else {
    const std::vector<std::string> of_level = check_level(problem, scene);
    check.warnings.insert(check.warnings.end(), of_level.begin(), of_level.end());
  }
  for (std::size_t c = 0; c < problem.contacts().size(); ++c) {
    const PenaltyContact::State state = problem.contacts()[c]->state_at_rest();
    check.contacts.push_back({scene.contacts[c].name, state.points, state.deepest, state.nearest, state.force});
  }
  check.conditions = report_points(problem.constraints(), problem.scene());
  for (const LevelProblem::Load& load : problem.loads()) check.forces.push_back({load.name, load.total});
  check.held_cells = problem.num_island_cells();
  check.needs_supports = !scene.dynamics;
  return check;
}

namespace {

/// Operator products that a step is worth: a V-cycle costs about 14, energies, forces and frames about 4.
double products_per_step(const Dynamics& d) {
  const int iterations = d.solver_iterations > 0 ? d.solver_iterations : d.solver == StepSolver::multigrid ? 4 : 60;
  const int newton = d.newton_iterations > 0 ? d.newton_iterations : 3;
  return newton * (4 + iterations * (d.solver == StepSolver::multigrid ? 15 : 1.3));
}

SolvePlan plan_motion(const hexmesh::Lattice& lattice, const Scene& scene, int level) {
  SolvePlan plan;
  plan.effects = list_effects(scene);
  const hexmesh::Level& cells = lattice.levels[static_cast<std::size_t>(level)];
  const auto count = static_cast<double>(cells.cells.size());
  const double seconds = scene.dynamics->num_steps() * products_per_step(*scene.dynamics) * count *
                         seconds_per_cell(lattice, scene, level, level);
  plan.levels = {{level, cells.cells.size(), 3 * hexmesh::number_nodes(cells.cells).nodes.size(), seconds,
                  expected_bytes(lattice, scene, level)}};
  for (Effect& e : plan.effects)
    if (e.kind == EffectKind::elasticity) e.seconds = seconds;
  return plan;
}

SolvePlan plan_equilibrium(const hexmesh::Lattice& lattice, const Scene& scene, int level) {
  SolvePlan plan;
  plan.effects = list_effects(scene);
  const int first = first_nested_level(cells_of_levels(lattice), level);
  const UsualCost& cost = usual_cost(scene.elasticity);
  const double products = cost.products * growth_with_poisson(lattice, scene);
  const double per_cell = seconds_per_cell(lattice, scene, first, level);
  double total = 0;
  for (int number = first; number >= level; --number) {
    const hexmesh::Level& cells = lattice.levels[static_cast<std::size_t>(number)];
    const auto count = static_cast<double>(cells.cells.size());
    plan.levels.push_back({number, cells.cells.size(), 3 * hexmesh::number_nodes(cells.cells).nodes.size(),
                           products * per_cell * count, expected_bytes(lattice, scene, number)});
    total += plan.levels.back().seconds;
  }
  for (Effect& e : plan.effects)
    if (e.kind == EffectKind::elasticity) e.seconds = total;
  return plan;
}

}  // namespace

std::size_t expected_bytes(const hexmesh::Lattice& lattice, const Scene& scene, int level) {
  double per_cell = usual_cost(scene.elasticity).bytes_per_cell;
  if (scene.saves_memory && has_frames(scene)) per_cell -= saved_per_cell;
  if (needs_braess_sarazin(lattice, scene)) per_cell += pressures_per_cell;
  return static_cast<std::size_t>(per_cell *
                                  static_cast<double>(lattice.levels[static_cast<std::size_t>(level)].cells.size()));
}

SolvePlan plan_solution(const hexmesh::Lattice& whole, const Scene& scene, int level) {
  std::size_t dropped = 0;
  const std::optional<hexmesh::Lattice> rest = without_islands(whole, scene, level, dropped);
  const hexmesh::Lattice& lattice = rest ? *rest : whole;
  return scene.dynamics ? plan_motion(lattice, scene, level) : plan_equilibrium(lattice, scene, level);
}

SolverTimes measure_solver(const hexmesh::Lattice& lattice, const Scene& scene, int level, int repeats) {
  LevelProblem problem(lattice, scene, level);
  problem.build_potential(scene.elasticity);
  Potential& potential = problem.potential();
  const auto dofs = static_cast<Eigen::Index>(problem.mesh().num_dofs());
  SolverTimes times{problem.mesh().num_cells(), problem.mesh().num_dofs()};
  const NodeVector u = NodeVector::Zero(dofs);
  NodeVector x = NodeVector::LinSpaced(dofs, -1, 1), y;
  problem.constraints().project(x);
  // Far enough from rest that no two linearizations are the same.
  int n = 0;
  const auto linearize_anew = [&](double projection) { potential.linearize(u + 1e-3 * ++n * x, projection); };
  times.project = median_seconds(repeats, [&] { linearize_anew(Hessian::projected); });
  times.linearize = median_seconds(repeats, [&] { linearize_anew(Hessian::exact); });
  times.product = median_seconds(repeats, [&] { potential.apply(x, y); });
  const FloatNodeVector single_x = x.cast<float>();
  FloatNodeVector single_y;
  potential.apply(single_x, single_y);  // makes its copies
  times.single_product = median_seconds(repeats, [&] { potential.apply(single_x, single_y); });
  std::unique_ptr<const Multigrid> multigrid;
  times.set_up = median_seconds(repeats, [&] {
    multigrid = std::make_unique<const Multigrid>(problem.hierarchy(), potential, problem.constraints());
  });
  times.cycle = median_seconds(repeats, [&] { multigrid->apply(x, y); });
  return times;
}

}  // namespace hexsolver
