// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "cli/tool.h"

namespace hextools {

/// What hexexport is asked for: names of files to write, empty where not asked for.
struct ExportOptions {
  std::string input;
  std::string lattice, surface, conditions, obstacles, csv, deck, report, html;
  std::vector<std::string> probes;
  std::string scan, warped, segmentation, grid, transform, transform_points;
  int level = -1;
  bool deformed = false;

  bool has_outputs() const;
  /// Whether something is asked for that takes the picture surface.
  bool shows_surface() const;
  /// Whether something is asked for that only a result has.
  bool needs_a_result() const;
  /// Likewise that only a solution has.
  bool needs_a_solution() const;
};

void add_options(CLI::App& app, ExportOptions& o);

/// @throws Error{usage} naming options that do not go together
void check_options(const ExportOptions& o);

}  // namespace hextools
