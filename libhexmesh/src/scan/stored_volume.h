// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <variant>
#include <vector>

#include "hexmesh/scan/image_io.h"

namespace hexmesh {

/// Values of a volume in the type their file keeps.
using StoredValues =
    std::variant<std::vector<std::uint8_t>, std::vector<std::int8_t>, std::vector<std::uint16_t>,
                 std::vector<std::int16_t>, std::vector<std::uint32_t>, std::vector<std::int32_t>,
                 std::vector<std::uint64_t>, std::vector<std::int64_t>, std::vector<float>, std::vector<double>>;

/// A volume as its file holds it.
struct StoredVolume {
  std::string format;  ///< e.g. "NRRD"
  Grid grid;
  std::size_t components = 1;  ///< values per voxel
  StoredValues values;         ///< shape (num_voxels, components), components fastest
  std::map<std::string, std::string> keys;
};

/// Read an image file: NRRD, MetaImage (ITK), NIfTI, VTI (VTK).
/// @throws Error{input}
StoredVolume read_stored(const std::filesystem::path& path, const ReadOptions& options);

/// All values as grey values.
/// @throws Error{input} where a voxel has several
IntensityVolume to_intensity(const StoredVolume& stored, const std::filesystem::path& path);

/// As segments, named where the file names them (.seg.nrrd), or else as a table does.
/// @throws Error{input} where a value is no label
Segmentation to_segmentation(const StoredVolume& stored, const std::filesystem::path& path, const LabelTable& names);

/// Whether every value is a whole number from 0 to 65535 and at most 256 of them differ: labels rather than grey
/// values.
bool looks_like_labels(const StoredVolume& stored);

/// NIfTI-1, packed or not.
StoredVolume read_nifti(const std::filesystem::path& path, const ReadOptions& options);

/// VTK image data in XML; in a file of its own since VTK and ITK do not share well.
StoredVolume read_vti(const std::filesystem::path& path, const ReadOptions& options);

}  // namespace hexmesh
