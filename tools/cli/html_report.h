// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "hexmesh/file/result_file.h"
#include "hexmesh/scan/label_volume.h"

namespace hextools {

/// What was solved, with pictures, tables, charts, inputs and their checksums, as one file that needs no other and no
/// network.
/// @param scan     shown in the pictures, if there is one
/// @param command  that made the report
void write_html_report(const hexmesh::Result& result, const hexmesh::IntensityVolume* scan, const std::string& command,
                       const std::filesystem::path& path);

}  // namespace hextools
