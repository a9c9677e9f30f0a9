// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "../file/refuse.h"
#include "hexmesh/core/error.h"
#include "hexmesh/core/grid.h"

namespace hexmesh {

/// The whole file; large values stay on disk until asked for.
/// @param reason  receives why DCMTK cannot read it
/// @returns nullptr where it cannot
std::unique_ptr<DcmFileFormat> try_load_dicom(const std::filesystem::path& path, std::string& reason);

/// @throws Error{input} where DCMTK cannot read it
std::unique_ptr<DcmFileFormat> load_dicom(const std::filesystem::path& path);

/// A text value with blanks trimmed; empty where it is not there.
std::string text_of(DcmItem& item, const DcmTagKey& tag);

/// All numbers of a value; empty where it is not there.
std::vector<double> numbers_of(DcmItem& item, const DcmTagKey& tag);

/// The first number, or `otherwise`.
double number_of(DcmItem& item, const DcmTagKey& tag, double otherwise);

/// Item n of a sequence, or nullptr.
DcmItem* item_of(DcmItem& item, const DcmTagKey& sequence, unsigned long n = 0);
unsigned long count_items(DcmItem& item, const DcmTagKey& sequence);

/// Where one frame's pixels are in the patient. Source: DICOM PS3.3, C.7.6.2.1.1.
struct FramePlane {
  Vec3 position;     ///< centre of the first pixel [mm]
  Vec3 row, column;  ///< unit vectors along a row (to the next column) and down a column (to the next row)
  double dx, dy;     ///< pixel size along row and column [mm]
  Vec3 normal() const { return row.cross(column); }
};

/// The functional group item of a frame: its own, or the shared one, or nullptr.
DcmItem* frame_group(DcmItem& dataset, unsigned long frame, const DcmTagKey& group);

/// @throws Error{input} where position, orientation or pixel size is missing or impossible
FramePlane frame_plane(const std::filesystem::path& path, DcmItem& dataset, unsigned long frame);

/// A length from the pixel measures of a frame or the dataset; 0 where neither has it [mm].
double pixel_measure(DcmItem& dataset, unsigned long frame, const DcmTagKey& tag);

}  // namespace hexmesh
