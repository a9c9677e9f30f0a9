// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "hexsolver/scene.h"

namespace hexsolver {

/// A 3D Slicer markup file (.mrk.json), in LPS [mm]; RAS files are converted.
struct Markup {
  std::string type;          ///< "Fiducial", "Line", "ROI", ...
  std::vector<Vec3> points;  ///< control points
  std::optional<Box> box;    ///< of a ROI
};

/// The first markup of the file.
/// Source: Slicer's markups schema 1.0.0 to 1.0.3.
/// @throws Error{input} naming the file and what is wrong
Markup read_markup(const std::filesystem::path& path);

}  // namespace hexsolver
