// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/file/result_file.h"
#include "rows.h"

namespace hextools {

/// A solution of someone else: rest positions and displacements in mm, LPS.
struct PointTable {
  std::vector<hexmesh::Vec3> positions, displacements;
  std::vector<bool> on_surface;  ///< empty without a column "surface"
};

/// Read comma-separated values with a header that names x, y, z, ux, uy, uz and, if known, surface; or those gzipped.
/// @throws Error{input}
PointTable read_points(const std::string& path);

/// Statistics of the distances between a result and the points of a table that its cells hold.
/// @throws Error{input} where they hold none
Row compare(const hexmesh::Result& result, const PointTable& table);

}  // namespace hextools
