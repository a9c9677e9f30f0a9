// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "hexmesh/core/grid.h"

namespace hexmesh {

/// One labelled structure of a segmentation.
struct Segment {
  std::uint16_t label = 0;                        ///< its value in LabelVolume::labels; never 0
  std::string name;                               ///< e.g. "liver"
  std::array<double, 3> color = {0.8, 0.5, 0.4};  ///< RGB, each in [0, 1]
  std::string terminology;                        ///< as 3D Slicer's TerminologyEntry: seven parts between ~, or empty
};

/// A segmented scan: one label per voxel, 0 = background.
struct LabelVolume {
  Grid grid;
  std::vector<std::uint16_t> labels;  ///< shape (grid.num_voxels()), i fastest
  std::vector<Segment> segments;      ///< one per label that may occur, ascending by label
};

/// The label of the voxel that holds a position [mm]; 0 outside the grid.
std::uint16_t label_at(const Grid& grid, std::span<const std::uint16_t> labels, const Vec3& position);

/// Voxels of each segment, in the order of `volume.segments`.
std::vector<std::size_t> count_voxels(const LabelVolume& volume);

/// The segment of that name (case does not matter) or nullptr.
const Segment* find_segment(const std::vector<Segment>& segments, const std::string& name);

/// The same volume with axes permuted and flipped to be right-handed and nearest to L, P, S, so that every one of the
/// 48 ways to store a scan gives the same voxels in the same order.
LabelVolume reorient_to_lps(LabelVolume volume);

}  // namespace hexmesh
