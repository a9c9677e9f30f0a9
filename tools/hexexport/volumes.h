// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "hexmesh/volume/label_volume.h"
#include "output_writer.h"

namespace hextools {

/// The scan of --scan, read when it is first asked for.
class ScanOfResult {
public:
  /// @param file  nullptr if none is given
  ScanOfResult(const Input* file, const hexmesh::Result& result, const Console& console)
      : file_(file), result_(result), console_(console) {}

  /// Nothing where no scan is given. @throws Error{input} if it covers no part of the body
  const hexmesh::IntensityVolume* get();

private:
  const Input* file_;
  const hexmesh::Result& result_;
  const Console& console_;
  std::optional<hexmesh::IntensityVolume> scan_;
};

/// The deformed scan and segmentation, and the transforms between the body at rest and deformed.
/// @param grid  the file of --grid, or nullptr
/// @throws Error{geometry} where a transform cannot hold the deformation; Error{input} for a grid beside the body
void write_volumes(const ExportOptions& o, const hexmesh::Result& result, ScanOfResult& scan, const Input* grid,
                   const OutputWriter& writer, const Console& console);

}  // namespace hextools
