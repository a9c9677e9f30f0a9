// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/tool.h"
#include "hexmesh/lattice/lattice.h"

namespace hextools {

/// Levels, segments and materials of a lattice, as FORMATS.md lists the keys.
/// @param has_matrices  which levels' matrices its file holds
nlohmann::json describe(const hexmesh::Lattice& lattice, const std::vector<bool>& has_matrices);

/// The same as a table for reading.
std::string table(const nlohmann::json& report);

/// The finest level with cells that join what is apart.
void note_joined(const nlohmann::json& report, const Console& console);

}  // namespace hextools
