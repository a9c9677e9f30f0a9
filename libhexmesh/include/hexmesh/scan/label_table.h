// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

namespace hexmesh {

/// What a label value stands for.
struct LabelMeaning {
  std::string name;
  std::array<double, 3> color;  ///< RGB, each in [0, 1]
};

/// Meanings of label values, never of 0.
using LabelTable = std::map<std::uint16_t, LabelMeaning>;

/// Read a table of label values: lines VALUE NAME R G B A as of 3D Slicer (.ctbl) and FreeSurfer, or
/// VALUE R G B A VISIBLE MESH "NAME" as ITK-SNAP's label descriptions; colours 0 to 255, # begins a comment.
/// @throws Error{input} naming the line
LabelTable read_label_table(const std::filesystem::path& path);

}  // namespace hexmesh
