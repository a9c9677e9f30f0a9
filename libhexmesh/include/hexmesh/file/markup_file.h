// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "hexmesh/geometry/markup.h"

namespace hexmesh {

/// The first markup of a 3D Slicer markup file (.mrk.json, .fcsv), or points of elastix (.txt); RAS coordinates are
/// converted to LPS.
/// Source: Slicer's markups schema 1.0.0 to 1.0.3, and its fiducial list (.fcsv) versions 4.
/// @throws Error{input} naming the file and what is wrong
Markup read_markup(const std::filesystem::path& path);

}  // namespace hexmesh
