// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hexmesh/lattice/lattice.h"

namespace hexmesh {

/// Version of the lattice file's layout; readers refuse others. See FORMATS.md.
inline constexpr int lattice_version = 4;
inline constexpr int split_lattice_version = 5;                   ///< of lattices whose cells are split
inline constexpr const char* lattice_format = "hexmesh lattice";  ///< as its header says

/// Which levels' matrices a lattice file holds: those that take at most 60 bytes a voxel, all above level 0, none.
enum class MatrixStorage : std::uint8_t { automatic, all, none };

/// @throws Error{output}
void write_lattice(const Lattice& lattice, const std::filesystem::path& path,
                   MatrixStorage storage = MatrixStorage::automatic);

/// Where the elements of a level come from.
enum class Elements : std::uint8_t {
  formed,  ///< from the materials of its voxels, by Level::children
  stored,  ///< from Level::matrices where the file has these, else formed
};

/// Whether labels and picture surface are read, which pictures need and whatever changes the voxels; a solution does
/// not.
enum class Voxels : std::uint8_t { read, left_out, surface_only };

/// @param levels    which levels to read; of the others only `children` below the coarsest one wanted whose elements
///                  are to be formed are there, which form_elements() needs. Nothing here reads all
///
/// What is read is a lattice: its levels, elements, labels and surface fit together. It costs a few per cent of
/// reading, and tells nothing of what is not read; check_lattice() looks at all of a file and forms it anew.
/// @throws Error{input} naming the file and what is wrong with it
Lattice read_lattice(const std::filesystem::path& path, const std::vector<int>& levels = {},
                     Elements elements = Elements::formed, Voxels voxels = Voxels::read);

/// SHA-256 of what the file holds, as it was written: the same for the same lattice, however HDF5 lays it out.
std::string content_checksum(const std::filesystem::path& path);

/// Whether it still is what the file holds: nothing was changed since it was written. @throws Error{input}
bool is_as_written(const std::filesystem::path& path);

/// Number of cells of each level of a lattice file.
std::vector<std::size_t> cells_of_levels(const std::filesystem::path& path);

/// The stored matrices of a level against those formed from the materials: the largest difference of a value, relative
/// to the largest value of its dataset; nothing if there are none.
/// @param lattice  read from the same file, with all levels
/// @throws Error{input}
std::optional<double> stored_matrix_error(const std::filesystem::path& path, const Lattice& lattice, int level);

/// Which levels of a lattice file have matrices.
std::vector<bool> levels_with_matrices(const std::filesystem::path& path);

/// What a file of ours is by its header: lattice_format or result_format.
/// @throws Error{input} if it is neither
std::string format_of(const std::filesystem::path& path);

}  // namespace hexmesh
