// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/scan/image_io.h"

namespace hexmesh {

/// A segment with its whole size, overlaps with others included.
struct SegmentSummary {
  Segment segment;
  std::size_t voxels = 0;
  struct Box {
    Vec3 low, high;
  };
  std::optional<Box> box;  ///< of its voxels, LPS [mm]; nothing where there are none
};

/// One thing found in an input: a volume, a DICOM series, a DICOM segmentation.
struct ScanSummary {
  std::string format;                                      ///< "NRRD", "DICOM CT series", "DICOM SEG", ...
  std::string name;                                        ///< the file, or the UID of the series
  std::vector<std::pair<std::string, std::string>> facts;  ///< what else there is to know, in words
  std::optional<Grid> grid;                                ///< as it is stored
  std::size_t layers = 0;                                  ///< of a segmentation
  std::vector<SegmentSummary> segments;
  std::optional<std::pair<double, double>> range;  ///< lowest and highest grey value of a scan
};

/// What an input holds. A volume of few different whole numbers, mostly the same in neighbours, counts as a
/// segmentation.
/// @throws Error{input}
std::vector<ScanSummary> summarize(const std::vector<std::filesystem::path>& paths, const ReadOptions& options = {});

/// Towards which side of the patient the axes of a grid point, e.g. "LPS"; lower case where more than 1 degree off.
std::string axis_letters(const Grid& grid);

}  // namespace hexmesh
