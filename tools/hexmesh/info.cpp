// SPDX-License-Identifier: Apache-2.0
#include "cli/json_text.h"
#include "cli/streams.h"
#include "commands.h"
#include "hexmesh/file/atomic_file.h"
#include "hexmesh/file/lattice_file.h"
#include "lattice_report.h"

namespace hextools {
namespace {

int run_info(const std::string& lattice, bool as_json) {
  const hexmesh::InputFile file(lattice);
  nlohmann::json report =
      describe(hexmesh::read_lattice(file.path(), {}, hexmesh::Elements::formed, hexmesh::Voxels::surface_only),
               hexmesh::levels_with_matrices(file.path()));
  report["sha256"] = hexmesh::content_checksum(file.path());
  as_json ? print_data(json_text(report)) : print(table(report));
  return 0;
}

}  // namespace

std::function<int()> declare_info(CLI::App& app, const CommonOptions& /*common*/, const Console& /*console*/) {
  const auto lattice = std::make_shared<std::string>();
  const auto as_json = std::make_shared<bool>(false);
  app.add_option("lattice", *lattice, "Lattice file; - is standard input")->required();
  app.add_flag("--json", *as_json, "As JSON");
  return [=] { return run_info(*lattice, *as_json); };
}

}  // namespace hextools
