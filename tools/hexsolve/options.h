// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "cli/tool.h"
#include "hexsolver/scene/scene.h"

namespace hextools {

/// What hexsolve is asked for.
struct SolveOptions {
  std::string lattice, scene, output, report;
  std::vector<std::string> settings;
  std::string levels, accuracy;  ///< as given
  hexsolver::Request request;    ///< what they say
  bool example = false, check = false, plan = false;
  std::string stream;         ///< "surface" or "nodes"; empty: nothing
  std::string steer, record;  ///< commands of a viewer, and what was carried out
};

void add_options(CLI::App& app, SolveOptions& o);

}  // namespace hextools
