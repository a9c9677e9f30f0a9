// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/tool.h"

namespace hextools {

/// What hexsolve is asked for.
struct SolveOptions {
  std::string lattice, scene, output, report;
  std::vector<std::string> settings;
  std::optional<int> level;       ///< the finest
  std::optional<int> coarser_by;  ///< graded cells, in levels
  std::string levels;             ///< as given
  std::string accuracy;           ///< as given
  std::optional<double> accuracy_mm, accuracy_reactions, budget;
  bool example = false, check = false, plan = false, stream = false;
};

void add_options(CLI::App& app, SolveOptions& o);

}  // namespace hextools
