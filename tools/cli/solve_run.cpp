// SPDX-License-Identifier: Apache-2.0
#include "cli/solve_run.h"

#include <fmt/format.h>
#include <omp.h>

#include "hexmesh/core/error.h"
#include "hexmesh/file/lattice_file.h"
#include "hexsolver/plan/plan.h"

namespace hextools {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexsolver::Scene;
using hexsolver::SolveReport;

hexmesh::Lattice read_lattice(const std::filesystem::path& path, const Scene& scene, std::optional<int> asked,
                              bool pictures, int& level) {
  hexsolver::LatticeNeeds needs;
  needs.pictures = pictures || !scene.matches.empty();
  if (scene.level != 0) {  // of which there is one always, and it needs all
    const std::vector<std::size_t> num_cells = hexmesh::cells_of_levels(path);
    const int count = static_cast<int>(num_cells.size());
    if (asked && *asked >= count)
      throw Error(ErrorKind::usage, fmt::format("--level is {}, expected 0 to {}", *asked, count - 1));
    level = hexsolver::finest_level(scene, num_cells);
    for (int n = hexsolver::finest_level_needed(scene, num_cells, level); n < count; ++n) needs.levels.push_back(n);
  }
  const hexsolver::LatticeNeeds all = {{}, true};
  if (scene.islands != hexsolver::Islands::error && scene.is_open_ended())
    return hexsolver::read_lattice_for(scene, path, all);
  hexmesh::Lattice lattice = hexsolver::read_lattice_for(scene, path, needs);
  if (hexsolver::leaves_islands_out(lattice, scene, level)) lattice = hexsolver::read_lattice_for(scene, path, all);
  return lattice;
}

int fit_into_memory(const hexmesh::Lattice& lattice, int finest, Scene& scene, const Console& console) {
  std::string note;
  const int level = hexsolver::fit_into_memory(lattice, finest, scene, note);
  if (!note.empty()) console.note(note);
  return level;
}

hexsolver::Outcome solve_equilibrium(const hexmesh::Lattice& lattice, const Scene& scene, int level,
                                     const Console& console) {
  return hexsolver::solve_equilibrium(lattice, scene, level, progress_on(console, work_of(lattice, scene, level)));
}

int judge(const SolveReport& report, const std::string& output, const Console& console) {
  if (report.accuracy_missed) {
    console.error(fmt::format("accuracy not reached: {}; '{}' holds that level, solved", report.reason, output));
    return exit_not_converged;
  }
  if (report.converged) return 0;
  console.error(fmt::format("{}{}{}", report.interrupted ? "" : "not converged: ", report.reason,
                            output.empty() ? "" : what_is_kept(report, output)));
  return exit_not_converged;
}

void add_times(nlohmann::json& summary, const SolveReport& report, const RunTimes& times, double solve_done) {
  summary["seconds"] = {{"read", times.read_done - times.start},
                        {"setup", report.setup_seconds},
                        {"solve", report.solve_seconds},
                        {"write", omp_get_wtime() - solve_done},
                        {"total", omp_get_wtime() - times.start}};
  add_costs(summary, report);
}

}  // namespace hextools
