// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cli/run_files.h"
#include "hexmesh/result/result.h"
#include "hexmesh/view/slice.h"
#include "hexmesh/volume/intensity_volume.h"

namespace hextools {

/// A result with its picture surface.
/// @throws Error{input}
hexmesh::Result read_with_surface(const std::filesystem::path& path);

/// Say so if a result is not the solution of its scene, or leaves parts of the body out.
void warn_of_state(const hexmesh::Result& result, const Console& console);

/// What a picture of a result has to say beside itself: that it is not converged, or a motion's end; else nothing.
std::string state_note(const hexmesh::Result& result);

/// Whether it shows a scene that is not solved.
bool is_preview(const hexmesh::Result& result);

/// Names of the conditions of its scene that move their points.
std::set<std::string> moved_by(const hexmesh::Result& result);

/// The obstacles of its scene, where they are at the end.
std::vector<hexmesh::Obstacle> obstacles_of(const hexmesh::Result& result);

/// The scan of a result.
/// @param file  or nullptr, for none
/// @throws Error{input} if it covers no part of the body
std::optional<hexmesh::IntensityVolume> read_scan_of(const hexmesh::Result& result, const Input* file,
                                                     const Console& console);

}  // namespace hextools
