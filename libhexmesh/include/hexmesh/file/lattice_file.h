// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "hexmesh/lattice/lattice.h"

namespace hexmesh {

/// Version of the lattice file's layout; readers refuse newer ones. See FORMATS.md.
inline constexpr int lattice_version = 1;

/// @throws Error{output}
void write_lattice(const Lattice& lattice, const std::filesystem::path& path);

/// @param levels  which levels to read, the others stay empty; nothing here reads all
/// @throws Error{input} naming the file and what is wrong with it
Lattice read_lattice(const std::filesystem::path& path, const std::vector<int>& levels = {});

/// Number of levels in a lattice file.
int count_levels(const std::filesystem::path& path);

}  // namespace hexmesh
