// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "options.h"

namespace hextools {

/// All inputs as segments of one grid.
hexmesh::Segmentation gather(const ScanOptions& o, const hexmesh::ReadOptions& options, const Console& console);

}  // namespace hextools
