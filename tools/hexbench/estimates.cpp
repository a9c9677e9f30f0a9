// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "cli/json_text.h"
#include "cli/scene_input.h"
#include "commands.h"
#include "hexmesh/core/error.h"
#include "level_errors.h"
#include "rows.h"
#include "scene_options.h"

namespace hextools {
namespace {

struct EstimatesOptions {
  SceneOptions scene;
  int least_cells = 100;
  std::vector<double> accuracies;
};

Row to_row(const Estimated& e) { return {{"estimate", e.estimate ? Row(*e.estimate) : Row()}, {"error", e.error}}; }

Row to_row(const LevelErrors& errors) {
  Row reactions = Row::array();
  for (const Estimated& e : errors.reactions) reactions.push_back(to_row(e));
  Row equations;  // null where there are none to tell
  if (errors.equations) {
    equations = to_row(*errors.equations);
    equations["reactions_n"] = errors.reactions_of_equations;
  }
  return {{"level", errors.level},
          {"cells", errors.cells},
          {"unknowns", errors.unknowns},
          {"converged", errors.converged},
          {"mean_mm", to_row(errors.mean)},
          {"max_mm", to_row(errors.largest)},
          {"strain_energy_n_mm", to_row(errors.energy)},
          {"reactions_n", reactions},
          {"equations_mm", equations}};
}

std::string words(const Estimated& e) {
  return fmt::format("{} mm estimated, {:.3g} mm true", e.estimate ? fmt::format("{:.3g}", *e.estimate) : "unknown",
                     e.error);
}

int run_estimates(const EstimatesOptions& o, const CommonOptions& common, const Console& console) {
  RunFiles files(common);
  const SceneOnLevel on = read_scene_on_level(o.scene, false, files, !o.accuracies.empty());
  Output& output = files.output(o.scene.output, Content::text);
  const LevelErrorMeter meter(on.lattice, on.scene);
  Row levels = Row::array(), accuracies = Row::array();
  const int finest = on.scene.is_graded() ? 0 : 1;  // level 0 alike is the measure
  for (int level = coarsest_level(on.lattice, static_cast<std::size_t>(o.least_cells)); level >= finest; --level) {
    const LevelErrors errors = meter.of_level(level);
    console.note(fmt::format("level {}, {} cells: mean error {}", errors.level, errors.cells, words(errors.mean)));
    levels.push_back(to_row(errors));
  }
  for (const double part : o.accuracies) {
    const double asked = part * meter.mean_displacement();
    const LevelErrors errors = meter.of_accuracy(asked);
    console.note(fmt::format("accuracy of {:.3g} mm: level {}, {}{}", asked, errors.level, words(errors.mean),
                             errors.accuracy_missed ? ", told to be missed" : ""));
    Row row = to_row(errors);
    row["asked_mm"] = asked;
    row["missed"] = errors.accuracy_missed;
    accuracies.push_back(std::move(row));
  }
  output.write(json_text(Row{{"mean_displacement_mm", meter.mean_displacement()},
                             {"largest_reaction_n", meter.largest_reaction()},
                             {"strain_energy_n_mm", meter.strain_energy()},
                             {"levels", levels},
                             {"accuracies", accuracies}}));
  files.commit();
  return 0;
}

}  // namespace

std::function<int()> declare_estimates(CLI::App& app, const CommonOptions& common, const Console& console) {
  const auto o = std::make_shared<EstimatesOptions>();
  add_lattice(app, o->scene);
  app.add_option("scene", o->scene.scene, "Scene of an equilibrium (TOML)")->required();
  app.add_option("--least-cells", o->least_cells, "Of the levels that are measured")
      ->check(CLI::Range(1, 1'000'000'000))
      ->capture_default_str();
  app.add_option("--accuracies", o->accuracies,
                 "Accuracies to ask for as well, as parts of the mean displacement, e.g. 0.1,0.03")
      ->delimiter(',')
      ->check(CLI::Range(1e-6, 1.0));
  add_report(app, o->scene.output);
  return [o, &common, &console] { return run_estimates(*o, common, console); };
}

}  // namespace hextools
