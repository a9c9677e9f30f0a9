// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "cli/tool.h"

namespace hextools {

/// Which inputs make a labelled volume, which segments of theirs, and how these are cut out and cleaned.
struct SegmentOptions {
  std::vector<std::string> inputs, named_inputs, segments, priority;
  std::string series, label_names;
  double fraction = 0.5, spacing = 0, scale = 1, thickness = 0;
  std::string name_of_drawn;  ///< inputs are a scan, of which a segment of this name is made
  std::string threshold, connected_to, sphere, implicit;
  std::string roi, roi_markup;
  double margin = -1;
  double open = 0, close = 0, specks_ml = 0, isotropic = -1;
  bool fill_cavities = false, largest_component = false;

  bool has_inputs() const { return !inputs.empty() || !named_inputs.empty() || !name_of_drawn.empty(); }
};

/// --labels
void add_label_names(CLI::App& app, SegmentOptions& o);

/// All of them.
void add_segment_options(CLI::App& app, SegmentOptions& o);

}  // namespace hextools
