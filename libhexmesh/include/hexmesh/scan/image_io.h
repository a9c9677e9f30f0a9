// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <limits>
#include <optional>

#include "hexmesh/scan/label_table.h"
#include "hexmesh/volume/segmentation.h"

namespace hexmesh {

/// How inputs are read.
struct ReadOptions {
  double fraction = 0.5;  ///< a FRACTIONAL DICOM SEG: at least this share of a voxel belongs to the segment
  LabelTable names;       ///< of labels that the file itself does not name
  std::string series;     ///< SeriesInstanceUID, or its end, where a folder holds several
  std::size_t max_memory = std::numeric_limits<std::size_t>::max();  ///< for the voxels of one input [bytes]
  std::optional<Grid> reference;  ///< as stored: where contours and sparse frames go, instead of the scan beside them
  std::function<void(const std::string&)> warn = [](const std::string&) {};  ///< what was assumed or changed
};

/// Read a segmentation: NRRD and .seg.nrrd (3D Slicer; names, colours, terminology and layers kept), NIfTI, MetaImage,
/// VTI, DICOM SEG, DICOM RTSTRUCT with the scan it was drawn on, or a folder with one of the latter two.
///
/// The format is told from the content, not the name. Axes are reordered to be right-handed and nearest to L, P, S.
/// Labels without a name are called "label_N".
/// @throws Error{input}
Segmentation read_segmentation(const std::vector<std::filesystem::path>& paths, const ReadOptions& options = {});

/// The same as one label per voxel; where segments overlap the later one wins, with a warning.
LabelVolume read_labels(const std::filesystem::path& path, const ReadOptions& options = {});

/// Read a scan: the same image formats and reordering; a DICOM series (CT, MR, PET) as a folder or as its files.
/// @param stored  receives the grid before reordering, for ReadOptions::reference
/// @throws Error{input}
IntensityVolume read_intensity(const std::vector<std::filesystem::path>& paths, const ReadOptions& options = {},
                               std::optional<Grid>* stored = nullptr);
IntensityVolume read_intensity(const std::filesystem::path& path, const ReadOptions& options = {},
                               std::optional<Grid>* stored = nullptr);

/// Whether this is a folder or a DICOM file: several of them are one input.
bool is_dicom(const std::filesystem::path& path);

/// Write a labelled volume, compressed: NIfTI (.nii.gz, .nii), which holds labels only, or else NRRD with the segments'
/// names, colours and terminology as 3D Slicer keeps them (.seg.nrrd).
/// @throws Error{output}
void write_labels(const LabelVolume& volume, const std::filesystem::path& path);

/// Write grey values, 32-bit floats, compressed: NIfTI or else NRRD.
/// @throws Error{output}
void write_intensity(const IntensityVolume& volume, const std::filesystem::path& path);

}  // namespace hexmesh
