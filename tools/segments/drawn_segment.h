// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "hexmesh/geometry/box.h"
#include "segments/gather.h"

namespace hextools {

/// The voxels of a scan, or of a box, that --threshold, --sphere and --implicit have in common, as one segment.
/// @param zone  of interest, if one is asked for; the grid where there is no scan
/// @throws Error{usage} naming what is no number or expression, or missing
hexmesh::LabelVolume drawn_segment(const SegmentOptions& o, const Sources& sources,
                                   const std::optional<hexmesh::Box>& zone, const hexmesh::ReadOptions& options);

/// --connected-to
/// @throws Error{geometry} where nothing is there
void keep_connected(const SegmentOptions& o, hexmesh::LabelVolume& volume);

}  // namespace hextools
