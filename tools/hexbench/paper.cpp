// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "cli/json_text.h"
#include "cli/run_files.h"
#include "commands.h"
#include "hexmesh/core/error.h"
#include "paper/measurements.h"
#include "scene_options.h"

namespace hextools {
namespace {

struct PaperOptions {
  std::vector<std::string> experiments;
  std::string json, output = "-";
};

using Measure = std::vector<Row>(const Console&);
const std::vector<std::pair<std::string, Measure*>> measurements = {
    {"table1", paper::table1}, {"fig4", paper::fig4},     {"fig5", paper::fig5},      {"fig7", paper::fig7},
    {"table2", paper::table2}, {"table3", paper::table3}, {"uniform", paper::uniform}};

/// @throws Error{usage} for an unknown name
std::vector<Row> measure(const std::string& name, const Console& console) {
  for (const auto& [known, measure_it] : measurements)
    if (known == name) return measure_it(console);
  throw hexmesh::Error(
      hexmesh::ErrorKind::usage,
      fmt::format("unknown experiment '{}', expected table1, fig4, fig5, fig7, table2, table3 or uniform", name));
}

std::string cell_of(const Row& value) {
  if (value.is_null()) return "";
  if (value.is_number_float()) return fmt::format("{:.4g}", value.get<double>());
  return value.is_string() ? value.get<std::string>() : value.dump();
}

/// One table for each experiment.
std::string to_markdown(const std::string& name, const std::vector<Row>& rows) {
  std::string text =
      fmt::format("### {}\n| case | paper | ours | reference | reading |\n|---|---|---|---|---|\n", name);
  for (const Row& row : rows)
    text += fmt::format("| {} | {} | {} | {} | {} |\n", cell_of(row["case"]), cell_of(row["paper"]),
                        cell_of(row["ours"]), cell_of(row["reference"]), cell_of(row["reading"]));
  return text + "\n";
}

int run_paper(const PaperOptions& o, const CommonOptions& common, const Console& console) {
  RunFiles files(common);
  Output& output = files.output(o.output, Content::text);
  Output* rows_file = files.output_if_named(o.json, Content::text);
  std::vector<std::string> names = o.experiments;
  std::replace(names.begin(), names.end(), std::string("fig14"), std::string("table3"));  // its pictures
  if (names.empty())
    for (const auto& [name, measure_it] : measurements) names.push_back(name);
  std::string text;
  Row report;
  for (const std::string& name : names) {
    const std::vector<Row> rows = measure(name, console);
    text += to_markdown(name, rows);
    report[name] = rows;
  }
  output.write(text);
  if (rows_file) rows_file->write(json_text(report));
  files.commit();
  return 0;
}

}  // namespace

std::function<int()> declare_paper(CLI::App& app, const CommonOptions& common, const Console& console) {
  const auto o = std::make_shared<PaperOptions>();
  app.add_option("experiments", o->experiments,
                 "table1, fig4, fig5, fig7, table2, table3 (or fig14), uniform; all if none is named");
  app.add_option("--json", o->json, "All rows with all columns");
  add_report(app, o->output);
  return [o, &common, &console] { return run_paper(*o, common, console); };
}

}  // namespace hextools
