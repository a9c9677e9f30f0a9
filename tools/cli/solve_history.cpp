// SPDX-License-Identifier: Apache-2.0
#include "cli/solve_history.h"

#include "cli/checksum.h"
#include "cli/tool.h"
#include "hexsolver/scene/scene_files.h"

namespace hextools {

std::vector<std::string> files_read(const std::string& lattice, const std::filesystem::path& lattice_file,
                                    const std::string& scene_name, const std::filesystem::path& scene_file,
                                    const hexsolver::Scene& scene) {
  std::vector<std::string> read = {hexmesh::content_checksum(lattice_file) + "  " + lattice};
  if (!scene_name.empty()) read.push_back(checksum_line(scene_name, scene_file));
  for (const std::filesystem::path& file : hexsolver::files_of(scene))
    read.push_back(checksum_line(file.string(), file));
  return read;
}

std::string solve_history(const std::string& lattice, const std::filesystem::path& lattice_file,
                          const std::string& scene_name, const std::filesystem::path& scene_file,
                          const hexsolver::Scene& scene) {
  return history_entry(files_read(lattice, lattice_file, scene_name, scene_file, scene));
}

}  // namespace hextools
