// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <omp.h>

#include <algorithm>

#include "cli/checksum.h"
#include "cli/json_text.h"
#include "cli/progress.h"
#include "cli/scene_input.h"
#include "cli/solve_history.h"
#include "cli/solve_run.h"
#include "hexfit/options.h"
#include "hexfit/spread.h"
#include "hexfit/targets.h"
#include "hexfit/write_scene.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/lattice_file.h"
#include "hexmesh/file/result_file.h"

namespace {

using namespace hextools;
using hexsolver::Scene;
using nlohmann::json;

/// What acts beside the targets. Bodies are pulled hard: without a scene the law is one that resists folding.
Scene scene_of(const FitOptions& o, const Input* file, RunFiles& files) {
  if (file) return hextools::read_scene(*file, files, o.settings);
  std::vector<std::string> settings = o.settings;
  const bool names_law = std::any_of(settings.begin(), settings.end(), [](const std::string& s) {
    return s.starts_with("solve.law") || s.starts_with("solve.strain");
  });
  if (!names_law) settings.insert(settings.begin(), "solve.law=neo-hookean");
  return hexsolver::make_scene(settings);
}

int run(FitOptions& o, const CommonOptions& common, const Console& console) {
  RunTimes times;
  times.start = omp_get_wtime();
  RunFiles files(common);
  const Input& lattice_file = files.input(o.lattice);
  const Input* scene_file = files.input_if_named(o.scene, Content::text);
  const Targets targets(o, files, console);
  const SceneWriter scene_writer(o);
  Output& output = files.output(o.output, Content::binary, ".hexresult");
  Output* report_file = files.output_if_named(o.report, Content::text, ".json");

  Scene scene = scene_of(o, scene_file, files);
  if (o.level) scene.name_level(o.level);
  at_work("reading the targets");
  const std::vector<hexsolver::Match> matches = targets.read(hexmesh::read_lattice(lattice_file.path(), {-1}).segments);
  scene.matches.insert(scene.matches.end(), matches.begin(), matches.end());
  hexsolver::check_matches(scene);
  scene_writer.write(scene_file, matches, files);
  int level = 0;
  const hexmesh::Lattice lattice = read_lattice(lattice_file.path(), scene, o.level, true, level);
  times.read_done = omp_get_wtime();
  level = fit_into_memory(lattice, level, scene, console);
  hexsolver::Outcome fit = solve_equilibrium(lattice, scene, level, console);
  auto& [result, report] = fit;
  const std::vector<Spread> spread = o.without_spread || !report.converged
                                         ? std::vector<Spread>()
                                         : find_spread(lattice, lattice_file.path(), scene, fit, console);

  json summary = to_json(report, scene);
  summary["spread"] = json::array();
  for (const Spread& s : spread)
    summary["spread"].push_back({{"of", s.of}, {"mean_mm", s.mean_mm}, {"largest_mm", s.largest_mm}});
  result.history = lattice.history;
  std::vector<std::string> read =
      files_read(o.lattice, lattice_file.path(), o.scene, scene_file ? scene_file->path() : "", scene);
  for (const Input* file : targets.files()) read.push_back(checksum_line(file->name(), file->path()));
  result.history.push_back(history_entry(read));
  result.report = json_line(summary);
  result.costs = json_line(costs_of(report, times.read_done - times.start));
  const double solve_done = omp_get_wtime();
  hexmesh::write_result(result, output.path(), lattice_file.path());
  output.prepare();
  add_times(summary, report, times, solve_done);
  if (report_file) report_file->write(json_text(summary));
  files.commit();
  for (const std::string& w : report.warnings) console.warning(w);
  summarize(report, console);
  for (const Spread& s : spread)
    console.note(fmt::format("with {} the fit moves by {:.2g} mm in the mean, its surface by {:.2g} mm at most", s.of,
                             s.mean_mm, s.largest_mm));
  return judge(report, o.output, console);
}

}  // namespace

int main(int argc, char** argv) {
  auto o = std::make_shared<FitOptions>();
  return run_tool(argc, argv,
                  {"hexfit",
                   "Deform a body so that it lies on what is seen now: a surface or a part of one, a segmentation, "
                   "landmarks.",
                   "hexfit liver.hexmesh liver.nrrd -o fit.hexresult",
                   [o](CLI::App& app, const CommonOptions& common, const Console& console) -> std::function<int()> {
                     add_options(app, *o);
                     return [=, &common, &console] { return run(*o, common, console); };
                   }});
}
