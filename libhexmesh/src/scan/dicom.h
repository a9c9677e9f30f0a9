// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "hexmesh/scan/image_io.h"

namespace hexmesh {

enum class DicomKind { image, segmentation, contours, other };

/// What a DICOM file says it is; told by its SOP class before anything decodes it.
struct DicomFile {
  std::filesystem::path path;
  DicomKind kind = DicomKind::other;
  std::string modality, series_uid, description;
  std::string referenced_series;   ///< UID of the scan that a segmentation or contours were drawn on; empty: not said
  std::string frame_of_reference;  ///< UID of the space its positions are in; empty: not said
};

/// The images of one series.
struct DicomSeries {
  std::string uid, modality, description, frame_of_reference;
  std::vector<std::filesystem::path> files;
};

/// What lies in a folder, or is given as files.
struct DicomInput {
  std::vector<DicomSeries> images;  ///< ascending by UID
  std::vector<DicomFile> segmentations, contours, others;
};

/// Sort DICOM files by what they are; folders are searched, what is no DICOM there is left out. options.series chooses
/// among segmentations and contours where it is theirs.
/// @throws Error{input} where a file that was named is no DICOM, nothing was found, or no series is as asked for
DicomInput gather_dicom(const std::vector<std::filesystem::path>& paths, const ReadOptions& options);

/// The series asked for, or the only one.
/// @throws Error{input} listing the series where that leaves a choice
const DicomSeries& choose_series(const DicomInput& input, const ReadOptions& options);

/// The series that a segmentation or contours name; else the one asked for, or the only one, unless it says that it
/// lies in another space; else none.
const DicomSeries* referenced_series(const DicomInput& input, const DicomFile& file, const ReadOptions& options);

/// How the slices of a series lie.
struct SliceReport {
  double tilt_degrees = 0;                           ///< between the slices' normal and the line through their corners
  double least_distance = 0, greatest_distance = 0;  ///< of neighbours [mm]
  std::size_t slices = 0;
  bool regular = true;
};

/// The grid of a series without its pixels.
/// @throws Error{input}
Grid series_grid(const DicomSeries& series, const ReadOptions& options);

/// Slices ordered by where they are. Tilted or unevenly spaced ones are interpolated onto a regular grid.
/// @param report  receives how they lie
/// @throws Error{input}
IntensityVolume read_series(const DicomSeries& series, const ReadOptions& options, SliceReport* report = nullptr);

/// DICOM SEG: BINARY, FRACTIONAL, LABELMAP. Its frames define the grid; with options.reference on the same lattice of
/// voxels, they go there.
Segmentation read_dicom_segmentation(const DicomFile& file, const ReadOptions& options);

/// Names of the structures of an RTSTRUCT.
std::vector<std::string> contour_names(const DicomFile& file);

/// RTSTRUCT: the closed planar contours, filled on the grid of the scan they were drawn on.
/// @pre options.reference
Segmentation read_contours(const DicomFile& file, const ReadOptions& options);

}  // namespace hexmesh
