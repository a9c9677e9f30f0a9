// SPDX-License-Identifier: Apache-2.0
#include "motion.h"

#include <fmt/format.h>
#include <omp.h>

#include "cli/node_values.h"
#include "commands.h"
#include "hexmesh/lattice/embedded_points.h"
#include "hexsolver/dynamics/motion.h"
#include "machine.h"
#include "mesh/mesh.h"
#include "scene_options.h"
#include "statistics.h"

namespace hextools {
namespace {

using hexmesh::Lattice;
using hexsolver::Motion;
using hexsolver::Scene;
using hexsolver::StepSolver;
using nlohmann::json;

/// As many points as asked, evenly from the surface, some more than once if it has fewer.
std::vector<hexmesh::Vec3> sampled(const std::vector<hexmesh::Vec3>& points, std::size_t count) {
  std::vector<hexmesh::Vec3> out(count);
  for (std::size_t n = 0; n < count; ++n) out[n] = points[n * points.size() / count];
  return out;
}

json bench_level(const Lattice& lattice, Scene scene, int level, const Console& console) {
  scene.dynamics->duration = 1e6 * scene.dynamics->step;
  Motion motion(lattice, scene, level);
  bool solved = true;
  const double of_step = seconds_of_one([&] { solved = motion.step() && solved; });
  json row = {{"level", level},   {"cells", motion.mesh().num_cells()}, {"nodes", motion.mesh().num_nodes()},
              {"solved", solved}, {"steps_per_second", 1 / of_step},    {"surfaces", json::array()}};
  std::string words;
  const hexmesh::CellLocator locator = motion.locator();
  for (const std::size_t points : {229, 1455, 5541}) {
    const hexmesh::EmbeddedPoints surface(locator, motion.cell_nodes(), sampled(lattice.surface.points, points));
    std::vector<hexmesh::Vec3> moved;
    const double of_surface = seconds_of_one([&] { surface.interpolate(values_of(motion.displacement()), moved); });
    row["surfaces"].push_back({{"points", points}, {"steps_per_second", 1 / (of_step + of_surface)}});
    words += fmt::format(", {:.4g} with {} points", 1 / (of_step + of_surface), points);
  }
  console.note(fmt::format("level {}, {} cells, {} nodes: {:.4g} steps/s{}", level, motion.mesh().num_cells(),
                           motion.mesh().num_nodes(), 1 / of_step, words));
  return row;
}

struct Way {
  const char* name;
  StepSolver solver;
  int iterations;
};

json bench_ways(const Lattice& lattice, const Scene& scene, int level, const Console& console) {
  const auto run = [&](const Way& way) {
    Scene s = scene;
    s.dynamics->solver = way.solver;
    s.dynamics->solver_iterations = way.iterations;
    s.dynamics->newton_iterations = way.iterations > 0 ? 1 : 0;
    auto motion = std::make_unique<Motion>(lattice, s, level);
    const double start = omp_get_wtime();
    for (int n = 0; n < s.dynamics->num_steps(); ++n)
      if (!motion->step()) break;
    return std::make_pair(std::move(motion), (omp_get_wtime() - start) / s.dynamics->num_steps());
  };
  const auto [converged, of_converged] = run({"converged", StepSolver::multigrid, 0});
  json rows = json::array();
  const auto add = [&](const char* name, int iterations, const Motion& motion, double seconds) {
    const double off = (motion.displacement() - converged->displacement()).norm() / converged->displacement().norm();
    rows.push_back({{"solver", name},
                    {"iterations", iterations},
                    {"ms_per_step", 1e3 * seconds},
                    {"relative_difference", off},
                    {"solved", motion.time() >= converged->time()}});
    console.note(fmt::format("level {}, {} {}: {:.3g} ms a step, {:.2g} of the displacement off the converged motion",
                             level, name, iterations > 0 ? std::to_string(iterations) : "converged", 1e3 * seconds,
                             off));
  };
  for (const Way& way : {Way{"cg", StepSolver::cg, 5}, Way{"cg", StepSolver::cg, 10}, Way{"cg", StepSolver::cg, 40},
                         Way{"jacobi", StepSolver::jacobi, 5}, Way{"jacobi", StepSolver::jacobi, 10},
                         Way{"jacobi", StepSolver::jacobi, 40}, Way{"multigrid", StepSolver::multigrid, 1},
                         Way{"multigrid", StepSolver::multigrid, 2}, Way{"multigrid", StepSolver::multigrid, 4}}) {
    const auto [motion, seconds] = run(way);
    add(way.name, way.iterations, *motion, seconds);
  }
  add("multigrid", 0, *converged, of_converged);
  return rows;
}

/// What the paper's rotation of averaged edges costs beside the polar one, 10 conjugate gradient iterations a step.
json bench_rotations(const Lattice& lattice, Scene scene, int level, const Console& console) {
  scene.dynamics->duration = 1e6 * scene.dynamics->step;
  scene.dynamics->solver = StepSolver::cg;
  scene.dynamics->solver_iterations = 10;
  scene.dynamics->newton_iterations = 1;
  json rows = json::array();
  for (const auto& [name, rotation] :
       {std::pair{"polar", hexsolver::Rotation::polar}, {"edges", hexsolver::Rotation::edges}}) {
    scene.rotation = rotation;
    Motion motion(lattice, scene, level);
    bool solved = true;
    const double ms = 1e3 * seconds_of_one([&] { solved = motion.step() && solved; });
    rows.push_back({{"rotation", name}, {"ms_per_step", ms}, {"solved", solved}});
    console.note(fmt::format("level {}, rotation '{}': {:.3g} ms a step", level, name, ms));
  }
  return rows;
}

}  // namespace

json bench_motion_levels(const Lattice& lattice, const Scene& scene, const Console& console) {
  constexpr std::size_t least_cells = 8, most_cells = 20000;
  json levels = json::array();
  for (int l = static_cast<int>(lattice.levels.size()) - 1; l >= 0; --l) {
    const std::size_t cells = lattice.levels[static_cast<std::size_t>(l)].cells.size();
    if (cells >= least_cells && cells <= most_cells) levels.push_back(bench_level(lattice, scene, l, console));
  }
  return levels;
}

namespace {

/// The levels, and on the one asked for what the solvers of a step cost, how far each comes from the converged motion,
/// and what the two rotations cost.
json bench_motion(const SceneOnLevel& on, const Console& console) {
  json report = {{"threads", omp_get_max_threads()}, {"peak_gflops_of_a_thread", double_flops_of_a_thread() / 1e9}};
  console.note(fmt::format("{} threads, peak of one {:.3g} GFLOP/s", omp_get_max_threads(),
                           report["peak_gflops_of_a_thread"].get<double>()));
  report["levels"] = bench_motion_levels(on.lattice, on.scene, console);
  report["level"] = on.level;
  report["solvers"] = bench_ways(on.lattice, on.scene, on.level, console);
  report["rotations"] = bench_rotations(on.lattice, on.scene, on.level, console);
  return report;
}

}  // namespace

std::function<int()> declare_motion(CLI::App& app, const CommonOptions& common, const Console& console) {
  const auto o = add_scene_options(app);
  const auto measure = [](const SceneOnLevel& on, const SceneOptions&, const Console& talk) {
    return bench_motion(on, talk);
  };
  return run_on_scene(o, true, measure, common, console);
}

}  // namespace hextools
