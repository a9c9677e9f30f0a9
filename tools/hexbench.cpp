// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>

#include "cli/tool.h"
#include "hexmesh/file/lattice_file.h"
#include "hexmesh/lattice/element_tree.h"
#include "hexsolver/plan.h"

namespace {

using namespace hextools;
using hexmesh::Lattice;
using nlohmann::json;

struct Options {
  std::string input, scene, output = "-";
  int repeats = 5, level = 0;
};

double median(std::vector<double> seconds) {
  std::sort(seconds.begin(), seconds.end());
  return seconds[seconds.size() / 2];
}

template <class F>
double seconds_of(int repeats, F&& f) {
  std::vector<double> seconds;
  for (int n = 0; n < repeats; ++n) {
    const double start = omp_get_wtime();
    f();
    seconds.push_back(omp_get_wtime() - start);
  }
  return median(seconds);
}

/// Bytes read and written per second by memcpy of 256 MB.
double copy_bandwidth(int repeats) {
  constexpr std::size_t size = std::size_t{1} << 28;
  std::vector<char> from(size, 1), to(size);
  return 2.0 * size / seconds_of(repeats, [&] {
           std::memcpy(to.data(), from.data(), size);
           from[0] = to[size - 1];
         });
}

/// How fast the elements of all levels follow from the voxels, on one core.
json bench_lattice(const Lattice& lattice, int repeats) {
  double checksum = 0;
  std::size_t elements = 0;
  const double seconds = seconds_of(repeats, [&] {
    hexmesh::ElementTree tree(lattice);
    elements = 0;
    for (int l = 0; l < static_cast<int>(lattice.levels.size()); ++l) {
      const auto count = static_cast<std::int32_t>(lattice.levels[static_cast<std::size_t>(l)].filled.size());
      for (std::int32_t e = 0; e < count; ++e) checksum += tree.form(l, e).shear[0];
      elements += static_cast<std::size_t>(count);
    }
  });
  const auto voxels = static_cast<double>(lattice.levels.front().cells.size());
  json report = {{"voxels", voxels},
                 {"levels", lattice.levels.size()},
                 {"elements", elements},
                 {"seconds", seconds},
                 {"voxels_per_second", voxels / seconds},
                 {"copy_bytes_per_second", copy_bandwidth(repeats)},
                 {"checksum", checksum}};
  report["copied_bytes_per_voxel_time"] = report["copy_bytes_per_second"].get<double>() / (voxels / seconds);
  return report;
}

/// What a V-cycle and its set-up cost in operator products.
json bench_solver(const Lattice& lattice, const hexsolver::Scene& scene, int level, int repeats) {
  const hexsolver::SolverTimes t = hexsolver::measure_solver(lattice, scene, level, repeats);
  return {{"level", level},
          {"cells", t.cells},
          {"dofs", t.dofs},
          {"threads", omp_get_max_threads()},
          {"product_seconds", t.product},
          {"cells_per_second", static_cast<double>(t.cells) / t.product},
          {"linearize_products", t.linearize / t.product},
          {"multigrid_set_up_products", t.set_up / t.product},
          {"cycle_products", t.cycle / t.product}};
}

}  // namespace

int main(int argc, char** argv) {
  auto o = std::make_shared<Options>();
  return run_tool(
      argc, argv,
      {"hexbench", "Measure how fast this machine does what the tools do; medians, as JSON.",
       "hexbench lattice liver.hexmesh",
       [o](CLI::App& app, const CommonOptions& common, const Console&) -> std::function<int()> {
         app.require_subcommand(1);
         CLI::App* lattice = app.add_subcommand("lattice", "Element recursion of all levels, against memcpy");
         CLI::App* solver = app.add_subcommand("solver", "Multigrid of one level, against its operator product");
         for (CLI::App* sub : {lattice, solver}) {
           sub->add_option("lattice", o->input, "Lattice file; - is standard input")->required();
           sub->add_option("--repeats", o->repeats, "Runs of which the median counts")
               ->check(CLI::Range(1, 1000))
               ->capture_default_str();
           sub->add_option("-o,--output", o->output, "JSON; - is standard output")->capture_default_str();
         }
         solver->add_option("scene", o->scene, "Scene file (TOML)")->required();
         solver->add_option("--level", o->level, "Which level; 0 = voxels")
             ->check(CLI::Range(0, 30))
             ->capture_default_str();
         return [=, &common] {
           const hexmesh::InputFile file(o->input);
           const Lattice read = hexmesh::read_lattice(file.path());
           if (lattice->parsed()) {
             write_text(o->output, bench_lattice(read, o->repeats).dump(2) + "\n", common);
             return 0;
           }
           hexsolver::Scene scene = hexsolver::read_scene(o->scene, o->scene);
           scene.level = o->level;
           write_text(o->output,
                      bench_solver(hexsolver::with_overrides(read, scene), scene, hexsolver::finest_level(scene, read),
                                   o->repeats)
                              .dump(2) +
                          "\n",
                      common);
           return 0;
         };
       }});
}
