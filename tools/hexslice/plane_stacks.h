// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/tool.h"
#include "hexmesh/view/slice.h"

namespace hextools {

/// Which planes to draw and how: of hexslice planes and hexslice steps.
struct PlaneOptions {
  std::string input, scan, output, target;
  std::vector<std::string> axes;
  int count = 3;
  double every = 0;
  std::optional<double> at;
  std::vector<double> normal, point;
  std::string only;
  std::string background = "black";
  bool no_outlines = false, contact_sheet = false;
  hexmesh::SliceOptions slice;
};

/// Adds the options that planes and steps share.
void add_options(CLI::App& app, PlaneOptions& o);

/// Completes the options of the drawing by the others.
/// @throws Error{usage} naming options that do not go together
void check_options(PlaneOptions& o);

/// The planes of one direction.
struct PlaneStack {
  std::string name;
  hexmesh::Vec3 across;  ///< unit vector
  std::vector<hexmesh::SlicePlane> planes;
};

/// The planes asked for: of each axis, or across the normal.
/// @throws Error{usage} where they miss the body
std::vector<PlaneStack> make_stacks(const PlaneOptions& o, const hexmesh::Result& result);

}  // namespace hextools
