// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include "cli/tool.h"

namespace hextools {

/// What hexview is asked for.
struct ViewOptions {
  std::string input, scene;  ///< a result alone, or a lattice with the scene that moves it
  std::string scan, script, output, record, levels;
  std::vector<std::string> settings;
  std::string color = "segment";
  bool slices = false;
  double pace = 1;
  double reach = -1;  ///< [mm]; < 0: of the body's size
  std::vector<int> size = {1000, 750};
};

void add_options(CLI::App& app, ViewOptions& o);

}  // namespace hextools
