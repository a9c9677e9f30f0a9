// SPDX-License-Identifier: Apache-2.0
#include "show.h"

#include <fmt/format.h>

#include "cli/json_text.h"
#include "cli/solve_report.h"
#include "cli/streams.h"
#include "hexmesh/file/result_file.h"

namespace hextools {

namespace {

/// The report, and a text for people unless standard output has the report already.
int show(const nlohmann::json& report, const std::string& text, Output* file, RunFiles& files) {
  if (file) file->write(json_text(report));
  if (!file || !file->is_standard_output()) print(text);
  files.commit();
  return 0;
}

}  // namespace

int show_check(hexsolver::SceneCheck check, const hexsolver::Scene& scene, Output* report, Output* preview,
               const std::filesystem::path& lattice, std::vector<std::string> history, RunFiles& files,
               const Console& console) {
  if (preview && check.preview) {
    check.preview->report = json_line(preview_json(check, scene));
    check.preview->history = std::move(history);
    hexmesh::write_result(*check.preview, preview->path(), lattice);
  }
  for (const std::string& w : check.warnings) console.warning(w);
  std::string text;
  for (const hexsolver::ConditionReport& c : check.conditions)
    text += fmt::format("condition '{}': {} points, {} directions held\n", c.name, c.points, c.kept);
  for (const hexsolver::ForceReport& f : check.forces)
    text += fmt::format("force '{}': [{:.4g}, {:.4g}, {:.4g}] N\n", f.name, f.total_n[0], f.total_n[1], f.total_n[2]);
  for (const hexsolver::ContactReport& c : check.contacts)
    text += fmt::format("contact '{}': {:.3g} mm from the surface at rest\n", c.name, c.nearest_mm);
  if (check.dropped_cells > 0) text += fmt::format("islands left out: {} cells\n", check.dropped_cells);
  if (check.held_cells > 0) text += fmt::format("islands held by springs: {} cells\n", check.held_cells);
  text += fmt::format("level {}: {}\n", check.level,
                      check.is_carried       ? "nothing but obstacles holds all or parts of it"
                      : check.needs_supports ? "every part is held"
                                             : "a motion, in which nothing need be held");
  return show(to_json(check), text, report, files);
}

int show_plan(const hexsolver::SolvePlan& plan, Output* report, RunFiles& files) {
  std::string text;
  for (const hexsolver::Effect& e : plan.effects)
    text += fmt::format("{:3}  {}: {}\n", e.active ? "on" : "off", e.name, e.why);
  const auto show_level = [&](const hexsolver::SolvePlan::Level& l, const char* what_for) {
    text += fmt::format("level {}: {} cells, {} dofs, about {:.2g} s and {:.3g} MB{}\n", l.level, l.cells, l.dofs,
                        l.seconds, megabytes(l.bytes), what_for);
  };
  for (const hexsolver::SolvePlan::Level& l : plan.levels) show_level(l, "");
  if (plan.look) show_level(*plan.look, ", a look that far for the error estimate");
  text += fmt::format("in all about {:.2g} s and {:.3g} MB at the peak", plan.seconds(), megabytes(plan.bytes));
  const char* and_of_it = "; of it ";
  for (const auto& [seconds, what] : {std::pair(plan.reading_seconds, "to read the lattice"),
                                      std::pair(plan.strain_seconds, "to find whether cells have to rotate"),
                                      std::pair(plan.setup_seconds, "before the last level is solved")}) {
    if (seconds < 0.1 * plan.seconds()) continue;
    text += fmt::format("{}{:.2g} s {}", and_of_it, seconds, what);
    and_of_it = ", ";
  }
  text += '\n';
  if (plan.end) {
    text += fmt::format("expected to end on level {}", plan.end->level);
    if (!plan.end->why.empty()) text += ": " + plan.end->why;
    if (plan.end->most_seconds > 1.01 * plan.seconds())
      text += fmt::format("; all levels take about {:.2g} s", plan.end->most_seconds);
    text += '\n';
  }
  if (plan.finds_cells) text += "graded cells are halved for the accuracy on the way: this is what cells alike take\n";
  return show(to_json(plan), text, report, files);
}

}  // namespace hextools
