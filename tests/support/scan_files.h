// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "hexmesh/volume/label_volume.h"

/// Small scans in the forms they come in, written byte by byte or by DCMTK, independently of the readers.
namespace testing_support {

/// Bytes as a NIfTI-1 file: the sform says where the voxels are.
std::string nifti_bytes(const hexmesh::LabelVolume& volume);

/// Bytes as a NRRD file.
/// @param space  e.g. "left-posterior-superior"; positions are turned into it
std::string nrrd_bytes(const hexmesh::LabelVolume& volume, const std::string& space = "left-posterior-superior");

/// Bytes as a MetaImage with local data.
std::string meta_bytes(const hexmesh::LabelVolume& volume);

/// Bytes as a VTI file with text data.
std::string vti_bytes(const hexmesh::LabelVolume& volume);

/// A CT series, one file a slice, in a new folder. Grey values are the labels minus 1000.
/// @param shift  moves slice k [mm]
void write_ct_series(const hexmesh::LabelVolume& volume, const std::filesystem::path& folder,
                     const std::function<hexmesh::Vec3(int k)>& shift = nullptr, const std::string& uid = "1.2.3");

enum class SegType { binary, fractional, labelmap };

/// A DICOM SEG with one frame for each slice of each segment (for each slice in a label map) that holds voxels.
/// FRACTIONAL frames hold 200 of 250 in the segment and 50 beside it. Slices are four times as far apart as thick.
void write_dicom_seg(const hexmesh::LabelVolume& volume, SegType type, const std::filesystem::path& path);

/// An RTSTRUCT with two contours, side by side and almost in one plane, around the voxels [low, high] of each slice
/// from low[2] to high[2].
void write_rtstruct(const hexmesh::Grid& grid, const hexmesh::Index3& low, const hexmesh::Index3& high,
                    const std::filesystem::path& path);

/// Change or add one value of a DICOM file.
/// @param change  as dcmodify takes it, e.g. "SegmentSequence[0].SegmentLabel=liver"; [*] is every item
void edit_dicom(const std::filesystem::path& path, const std::string& change);

}  // namespace testing_support
