// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "hexmesh/result/result.h"
#include "hexmesh/volume/intensity_volume.h"

namespace hextools {

/// What was solved, with pictures, tables, charts, inputs and their checksums, as one file that needs no other and no
/// network.
/// @param scan     shown in the pictures, if there is one
/// @param made_by  the command that makes the report and the checksums of what it reads
std::string html_report(const hexmesh::Result& result, const hexmesh::IntensityVolume* scan,
                        const std::string& made_by);

}  // namespace hextools
