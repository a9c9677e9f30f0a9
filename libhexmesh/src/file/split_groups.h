// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "cell_checks.h"
#include "hdf5.h"

/// Groups of lattice and result files that only those have whose cells are split; see FORMATS.md.
namespace hexmesh::hdf5 {

void write_parting(Writer& file, const Parting& parting);  ///< nothing where nothing parts
Parting read_parting(const Reader& file, const std::vector<LatticeSegment>& segments);

/// @param group  the level's
void write_split(Writer& file, const std::string& group, const SplitCells& split);
/// Some layers of a level's cells, which begin with a layer of voxels and a row of the file.
struct PieceOfLevel {
  Grid voxels;  ///< of the whole
  std::int32_t first_layer = 0;
  std::size_t first_cell = 0, num_cells = 0;  ///< of all
};

/// @param voxels, cells  of the level, or of a piece of it: what is read is then of that, counted there
/// @throws Error{input} unless owners are as of read_owners() and nodes at one index are numbered without gaps
SplitCells read_split(const Reader& file, const std::string& group, const Grid& voxels, const StoredCells& cells,
                      const std::optional<PieceOfLevel>& piece = {});

void write_owners(Writer& file, const std::string& group, const VoxelOwners& owners);
/// @throws Error{input} unless each cell that shares its index, and no other, holds voxels of it
VoxelOwners read_owners(const Reader& file, const std::string& group, const Grid& voxels, const StoredCells& cells,
                        const std::optional<PieceOfLevel>& piece = {});
/// Those of a whole level, whose cells are not known here.
VoxelOwners read_all_owners(const Reader& file, const std::string& group, const Grid& voxels, std::size_t num_cells);

}  // namespace hexmesh::hdf5
