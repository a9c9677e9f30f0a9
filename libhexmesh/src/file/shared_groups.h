// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hdf5.h"
#include "hexmesh/lattice/lattice.h"

/// The groups that lattice and result files have in common; see FORMATS.md.
namespace hexmesh::hdf5 {

void write_header(Writer& file, const std::string& format, int version, const std::vector<std::string>& history);
/// @returns history
/// @param newest  the last version that is read, where it is more than one
std::vector<std::string> read_header(const Reader& file, const std::string& format, int version, int newest = 0);

void write_voxels(Writer& file, const Grid& grid, const std::vector<std::uint16_t>& labels);
void write_grid(Writer& file, const Grid& grid);  ///< the attributes alone
Grid read_grid(const Reader& file);
std::vector<std::uint16_t> read_labels(const Reader& file, const Grid& grid);

void write_segments(Writer& file, const std::vector<LatticeSegment>& segments);
/// @param voxels  that they share out
std::vector<LatticeSegment> read_segments(const Reader& file, const Grid& voxels);

/// @param of_voxels  whether it follows from the voxels
void write_surface(Writer& file, const TriangleSurface& surface, bool of_voxels);
/// In place of one that does.
void write_surface_of_voxels(Writer& file);
/// Whether the surface follows from the voxels, alone.
void write_surface_origin(Writer& file, bool of_voxels);
bool is_surface_of_voxels(const Reader& file);
TriangleSurface read_surface(const Reader& file);

void write_points(Writer& file, const std::string& name, const std::vector<Vec3>& points);
/// @param count  0: any
std::vector<Vec3> read_points(const Reader& file, const std::string& name, std::size_t count = 0);

void write_cell_rows(Writer& file, const std::string& name, const std::vector<Index3>& cells, hsize_t first);
void write_cells(Writer& file, const std::string& name, const std::vector<Index3>& cells);
/// Sorted, each there once unless they may share an index, at least one.
/// @param limit  each index is below it
std::vector<Index3> read_cells(const Reader& file, const std::string& name, const Index3& limit,
                               bool may_share = false);

/// Likewise some rows.
std::vector<Index3> read_cell_rows(const Reader& file, const std::string& name, const Index3& limit, hsize_t first,
                                   hsize_t count, bool may_share = false);

Index3 read_index(const Reader& file, const std::string& group, const std::string& name);

/// @throws Error{input} unless every value is within [0, limit)
void check_range(const Reader& file, const std::string& name, std::span<const std::int32_t> values, std::size_t limit);

}  // namespace hexmesh::hdf5
