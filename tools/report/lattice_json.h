// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "hexmesh/lattice/lattice.h"

namespace hextools {

/// Levels, segments and materials of a lattice, as FORMATS.md lists the keys.
/// @param has_matrices  which levels' matrices its file holds
nlohmann::json describe(const hexmesh::Lattice& lattice, const std::vector<bool>& has_matrices);

}  // namespace hextools
