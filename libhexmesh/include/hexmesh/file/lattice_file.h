// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "hexmesh/lattice/lattice.h"

namespace hexmesh {

/// Version of the lattice file's layout; readers refuse others. See FORMATS.md.
inline constexpr int lattice_version = 2;
inline constexpr const char* lattice_format = "hexmesh lattice";  ///< as its header says

/// @throws Error{output}
void write_lattice(const Lattice& lattice, const std::filesystem::path& path);

/// @param levels  which levels to read; of the others only `children` below the coarsest one wanted are there, which
///                form_elements() needs. Nothing here reads all
/// @throws Error{input} naming the file and what is wrong with it
Lattice read_lattice(const std::filesystem::path& path, const std::vector<int>& levels = {});

/// Number of levels in a lattice file.
int count_levels(const std::filesystem::path& path);

/// The matrices stored for other programs against those formed from the materials: the largest difference of a value,
/// relative to the largest value of its dataset.
/// @param lattice  read from the same file, with all levels
/// @throws Error{input}
double stored_matrix_error(const std::filesystem::path& path, const Lattice& lattice);

/// What a file of ours is by its header: lattice_format or result_format.
/// @throws Error{input} if it is neither
std::string format_of(const std::filesystem::path& path);

}  // namespace hexmesh
