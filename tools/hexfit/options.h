// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/tool.h"
#include "segments/segment_options.h"

namespace hextools {

/// What hexfit is asked for.
struct FitOptions {
  std::string lattice, scene, output, report, scene_output;
  std::vector<std::string> targets;    ///< surfaces and segmentations
  std::vector<std::string> landmarks;  ///< two files
  SegmentOptions segments;             ///< of the segmentations; its inputs are among the targets
  std::string body_segment;
  std::vector<std::string> settings;
  std::optional<int> level;
  double trust = 0;
  std::optional<double> outliers;
  bool is_part = false, without_spread = false;
};

void add_options(CLI::App& app, FitOptions& o);

}  // namespace hextools
