// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/check.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>

#include "cli/json_text.h"
#include "cli/streams.h"
#include "commands.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/atomic_file.h"
#include "hexmesh/file/lattice_file.h"

namespace hextools {
namespace {

using nlohmann::json;

int run_check(const std::string& name, bool as_json) {
  const hexmesh::InputFile file(name);
  const hexmesh::Lattice lattice = hexmesh::read_lattice(file.path());
  std::vector<hexmesh::Finding> findings = hexmesh::check_lattice(lattice);
  findings.push_back({"content is that of its checksum", 0, hexmesh::is_as_written(file.path()) ? 0.0 : 1.0, 0});
  std::vector<int> without_matrices;
  for (int n = 0; n < lattice.num_levels(); ++n) {
    if (const auto error = hexmesh::stored_matrix_error(file.path(), lattice, n))
      findings.push_back({"stored matrices are those of the voxels", n, *error, 1e-12});
    else
      without_matrices.push_back(n);
  }
  json report = json::array();
  std::string text = fmt::format("{:<44}{:>6}{:>12}{:>10}\n", "property", "level", "error", "limit");
  std::vector<std::string> broken;
  for (const hexmesh::Finding& f : findings) {
    report.push_back(
        {{"property", f.property}, {"level", f.level}, {"error", f.error}, {"limit", f.limit}, {"holds", f.holds()}});
    text += fmt::format("{:<44}{:>6}{:>12.1e}{:>10.0e}{}\n", f.property, f.level, f.error, f.limit,
                        f.holds() ? "" : "   BROKEN");
    if (!f.holds()) broken.push_back(fmt::format("'{}' at level {}", f.property, f.level));
  }
  if (!without_matrices.empty())
    text += fmt::format("levels without stored matrices, nothing to compare: {}\n", fmt::join(without_matrices, ", "));
  as_json ? print_data(json_text(report)) : print(text);
  if (!broken.empty())
    throw hexmesh::Error(hexmesh::ErrorKind::input,
                         fmt::format("lattice file '{}' breaks {} of {} properties: {}, expected none", name,
                                     broken.size(), findings.size(), fmt::join(broken, ", ")));
  return 0;
}

}  // namespace

std::function<int()> declare_check(CLI::App& app, const CommonOptions& /*common*/, const Console& /*console*/) {
  const auto lattice = std::make_shared<std::string>();
  const auto as_json = std::make_shared<bool>(false);
  app.add_option("lattice", *lattice, "Lattice file; - is standard input")->required();
  app.add_flag("--json", *as_json, "As JSON");
  return [=] { return run_check(*lattice, *as_json); };
}

}  // namespace hextools
