// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "hexmesh/volume/intensity_volume.h"
#include "hexmesh/volume/label_volume.h"

namespace hexmesh {

/// A segment and where its voxels are: those of `layer` that hold `value`.
struct LayeredSegment {
  Segment segment;  ///< its label is unique in the segmentation
  std::size_t layer = 0;
  std::uint16_t value = 0;
};

/// Segments as files hold them: they may overlap. Within a layer each voxel holds one value, 0 = nothing.
struct Segmentation {
  Grid grid;
  std::vector<std::vector<std::uint16_t>> layers;  ///< each of shape (grid.num_voxels()), i fastest
  std::vector<LayeredSegment> segments;            ///< in the file's order
};

/// A labelled volume is a segmentation of one layer.
Segmentation to_segmentation(LabelVolume volume);

/// A label that no segment has yet: `wanted` where it is free.
std::uint16_t free_label(const Segmentation& segmentation, std::uint16_t wanted);

/// Add a segment, given by its voxels' offsets, to the first layer where all of them are free.
void add_segment(Segmentation& to, Segment segment, const std::vector<std::size_t>& voxels);

/// Voxels of each segment, in the order of `segments`.
std::vector<std::size_t> count_voxels(const Segmentation& segmentation);

/// What `--segment` asks for: which one, and the name to give it.
struct SegmentChoice {
  std::string what;  ///< a label value ("5"), a name ("liver") or a terminology code ("SCT:10200004")
  std::string name;  ///< the new name; empty keeps the old one
};

/// Keep only the chosen segments.
/// @param choices  empty keeps everything
/// @throws Error{input} naming a segment that is not there, and those that are
Segmentation select_segments(Segmentation segmentation, const std::vector<SegmentChoice>& choices);

/// The segments of both, those of `more` last; labels that are taken are renumbered, and a segment of the same name is
/// the same segment.
/// @pre same_grid(base.grid, more.grid)
Segmentation combine(Segmentation base, Segmentation more);

/// All on one grid: the first one's, continued to hold `also` and the others. Where voxels do not coincide, labels come
/// from the nearest voxel.
/// @param warn  told of that, and of segments of one name that become one
Segmentation join(std::vector<Segmentation> parts, const std::vector<Grid>& also,
                  const std::function<void(const std::string&)>& warn);

/// Voxels that two segments share.
struct Overlap {
  std::string winner, loser;
  std::size_t voxels = 0;
};

/// One label per voxel. Where segments overlap, the one named first in `priority` wins; of those not named, the later
/// in the segmentation; one that is named wins over one that is not.
/// @throws Error{input} if `priority` names a segment that is not there
LabelVolume flatten(Segmentation segmentation, const std::vector<std::string>& priority,
                    std::vector<Overlap>& overlaps);

/// The smallest grid that continues `base` by whole voxels so that it holds the voxel centres of `other` too.
Grid extend_over(const Grid& base, const Grid& other);

/// Whether each voxel centre of `other` is one of `base`, continued by whole voxels, to within 1 % of a voxel.
bool same_lattice_of_voxels(const Grid& base, const Grid& other);

/// On another grid: each voxel takes what the voxel at its centre has; nothing outside.
Segmentation place_on(const Segmentation& segmentation, const Grid& grid);

/// On another grid: trilinear between voxel centres; the volume's lowest value outside.
IntensityVolume place_on(const IntensityVolume& volume, const Grid& grid);

Segmentation reorient_to_lps(Segmentation segmentation);

/// Sober colours that are easy to tell apart, for segments that have none.
std::array<double, 3> distinct_color(std::size_t n);

}  // namespace hexmesh
