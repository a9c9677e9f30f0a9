// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "cli/run_files.h"
#include "hexmesh/scan/image_io.h"
#include "segments/segment_options.h"

namespace hextools {

/// Segmentations and surfaces to read.
struct Sources {
  std::vector<const Input*> files;
  std::vector<std::pair<std::string, const Input*>> named;  ///< each one segment of that name
};

/// All of them as segments of one grid.
hexmesh::Segmentation gather(const SegmentOptions& o, const Sources& sources, const hexmesh::ReadOptions& options,
                             const Console& console);

}  // namespace hextools
