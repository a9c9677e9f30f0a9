// SPDX-License-Identifier: Apache-2.0
#include "cli/streams.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/temporary_file.h"
#include "options.h"
#include "scan_report.h"
#include "segments/segment_reader.h"

namespace hextools {
namespace {

int run_info(const ScanOptions& o, bool as_json, const CommonOptions& common, const Console& console) {
  std::vector<std::string> warnings;
  RunFiles files(common);
  hexmesh::ReadOptions options = read_options(o, files.input_if_named(o.label_names, Content::text), console);
  options.warn = [&](const std::string& message) { warnings.push_back(hexmesh::with_known_names(message)); };
  std::vector<std::filesystem::path> paths;
  for (const std::string& input : o.inputs) paths.push_back(files.input(input).path());
  if (paths.empty()) throw hexmesh::Error(hexmesh::ErrorKind::usage, "no input, expected a file or folder");
  const std::string text = describe_scans(paths, options, warnings, as_json);
  as_json ? print_data(text) : print(text);
  if (!as_json)
    for (const std::string& warning : warnings) console.warning(warning);
  return 0;
}

}  // namespace

std::function<int()> declare_info(CLI::App& app, const std::shared_ptr<ScanOptions>& o, const CommonOptions& common,
                                  const Console& console) {
  const auto as_json = std::make_shared<bool>(false);
  app.add_option("inputs", o->inputs, "Any input of hexscan, or a scan")->required();
  add_label_names(app, *o);
  app.add_flag("--json", *as_json, "As JSON");
  return [=, &common, &console] { return run_info(*o, *as_json, common, console); };
}

}  // namespace hextools
