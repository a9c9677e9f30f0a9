// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "cli/run_files.h"
#include "hexmesh/lattice/lattice.h"
#include "segments/segment_options.h"

namespace hextools {

/// What hexmesh build is asked for.
struct BuildOptions {
  SegmentOptions segments;
  std::string output, report, materials_file, intensity;
  std::vector<std::string> materials, surfaces, embedded;
  hexmesh::LatticeOptions lattice;
  double cell_size = 0;
  std::string matrices = "auto", gaps = "split";
  std::vector<std::pair<std::string, std::string>> sliding;
};

/// What it reads.
struct BuildInputs {
  const Input* materials = nullptr;  ///< or none, as the next
  const Input* intensity = nullptr;
  std::vector<std::pair<std::string, const Input*>> embedded;  ///< segments' surfaces
};

using Notes = std::vector<std::string>;  ///< said once all went well

}  // namespace hextools
