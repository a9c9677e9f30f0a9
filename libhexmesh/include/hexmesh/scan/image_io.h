// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "hexmesh/scan/label_volume.h"

namespace hexmesh {

/// Read a segmentation: NRRD and .seg.nrrd (3D Slicer; names, colours and layers kept), NIfTI, MetaImage.
///
/// The format is told from the content, not the name. Axes are reordered to be right-handed and nearest to L, P, S.
/// Where layers overlap the later segment wins. Labels without a name are called "label_N".
/// @throws Error{input}
LabelVolume read_labels(const std::filesystem::path& path);

/// Read a scan; the same formats and reordering.
/// @throws Error{input}
IntensityVolume read_intensity(const std::filesystem::path& path);

/// Write a labelled NRRD (gzip) with the segments' names and colours as 3D Slicer keeps them (.seg.nrrd).
/// @throws Error{output}
void write_labels(const LabelVolume& volume, const std::filesystem::path& path);

/// Write grey values as NRRD (gzip), 32-bit floats.
/// @throws Error{output}
void write_intensity(const IntensityVolume& volume, const std::filesystem::path& path);

}  // namespace hexmesh
