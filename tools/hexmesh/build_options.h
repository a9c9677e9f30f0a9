// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hexmesh/lattice/lattice.h"

namespace hextools {

/// What hexmesh build is asked for.
struct BuildOptions {
  std::string labels, output, report, materials_file, intensity;
  std::vector<std::string> materials, surfaces, embedded;
  hexmesh::LatticeOptions lattice;
  double cell_size = 0;
  std::string matrices = "auto";
};

using Notes = std::vector<std::string>;  ///< said once all went well

}  // namespace hextools
