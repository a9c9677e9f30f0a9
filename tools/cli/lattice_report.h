// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "cli/tool.h"
#include "hexmesh/lattice/lattice.h"

namespace hextools {

/// Levels, segments and materials of a lattice, as FORMATS.md lists the keys.
nlohmann::json describe(const hexmesh::Lattice& lattice);

/// The same as a table for reading.
std::string table(const nlohmann::json& report);

/// Where cells of a level join what is apart, for the coarsest level where fewer than one in ten do: there it matters.
void note_joined(const nlohmann::json& report, const Console& console);

}  // namespace hextools
