// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/scan/summary.h"

namespace hextools {

/// What inputs hold, as text or JSON. Surfaces and markups are told by their names.
/// @param warnings  those the readers gave; part of the JSON
std::string describe_scans(const std::vector<std::filesystem::path>& paths, const hexmesh::ReadOptions& options,
                           const std::vector<std::string>& warnings, bool as_json);

}  // namespace hextools
