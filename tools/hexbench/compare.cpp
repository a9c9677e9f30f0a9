// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "cli/json_text.h"
#include "cli/run_files.h"
#include "commands.h"
#include "hexmesh/file/dataset_compare.h"
#include "hexmesh/file/result_file.h"
#include "point_table.h"
#include "scene_options.h"

namespace hextools {
namespace {

constexpr int exit_differs = 1;  // of --exact, as of cmp and diff

struct CompareOptions {
  std::string result, reference, output = "-";
  bool exact = false;
};

int compare_results(const CompareOptions& o, const CommonOptions& common, const Console& console) {
  RunFiles files(common);
  const Input &first = files.input(o.result), &second = files.input(o.reference);
  Output& output = files.output(o.output, Content::text);
  if (!o.exact) {
    output.write(json_text(compare(hexmesh::read_result(first.path()), read_points(second.path()))));
    files.commit();
    return 0;
  }
  Row report = Row::array();
  for (const hexmesh::DatasetDifference& d : hexmesh::compare_datasets(first.path(), second.path())) {
    console.note(
        fmt::format("{} {}{}", d.name, d.what, d.largest > 0 ? fmt::format(", by {:.3g} at most", d.largest) : ""));
    report.push_back({{"dataset", d.name}, {"what", d.what}, {"largest", d.largest}});
  }
  if (report.empty()) console.note("all datasets are the same");
  output.write(json_text(report));
  files.commit();
  return report.empty() ? 0 : exit_differs;
}

}  // namespace

std::function<int()> declare_compare(CLI::App& app, const CommonOptions& common, const Console& console) {
  const auto o = std::make_shared<CompareOptions>();
  app.add_option("result", o->result, "Result file; - is standard input")->required();
  app.add_option("reference", o->reference,
                 "CSV with x, y, z, ux, uy, uz in mm, LPS (may be gzipped); with --exact a result file")
      ->required();
  app.add_flag("--exact", o->exact, "Which datasets of two results are not equal bit for bit; exit 1 if there are any");
  add_report(app, o->output);
  return [o, &common, &console] { return compare_results(*o, common, console); };
}

}  // namespace hextools
