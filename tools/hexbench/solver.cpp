// SPDX-License-Identifier: Apache-2.0
#include <omp.h>

#include <nlohmann/json.hpp>

#include "commands.h"
#include "hexsolver/plan/plan.h"
#include "scene_options.h"

namespace hextools {
namespace {

/// What a V-cycle and its set-up cost in operator products.
nlohmann::json bench_solver(const SceneOnLevel& on, int repeats) {
  const hexsolver::SolverTimes t = hexsolver::measure_solver(on.lattice, on.scene, on.level, repeats);
  return {{"level", on.level},
          {"cells", t.cells},
          {"dofs", t.dofs},
          {"threads", omp_get_max_threads()},
          {"product_seconds", t.product},
          {"single_product_seconds", t.single_product},
          {"cells_per_second", static_cast<double>(t.cells) / t.product},
          {"linearize_products", t.linearize / t.product},
          {"linearize_projected_products", t.project / t.product},
          {"multigrid_set_up_products", t.set_up / t.product},
          {"cycle_products", t.cycle / t.product}};
}

}  // namespace

std::function<int()> declare_solver(CLI::App& app, const CommonOptions& common, const Console& console) {
  const auto o = add_scene_options(app);
  const auto measure = [](const SceneOnLevel& on, const SceneOptions& options, const Console&) {
    return bench_solver(on, options.repeats);
  };
  return run_on_scene(o, false, measure, common, console);
}

}  // namespace hextools
