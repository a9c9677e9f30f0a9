// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "hexmesh/lattice/lattice.h"
#include "shared_groups.h"

/// The groups of a lattice file; see FORMATS.md.
namespace hexmesh::hdf5 {

std::string level_group(int level);
std::string children_name(int level);
std::string matrix_name(int level, const char* set);
std::string subcells_name(int level);
inline constexpr std::size_t matrix_block = 1 << 12;  ///< elements whose matrices are written as one

void write_materials(Writer& file, const std::vector<VoxelMaterial>& materials);
std::vector<VoxelMaterial> read_materials(const Reader& file, const std::vector<LatticeSegment>& segments);

int count_levels(const Reader& file);

std::size_t count_cells(const Reader& file, int level);
/// Likewise of a file whose outline is known: no more and no fewer than its voxels may make.
std::size_t count_cells(const Reader& file, const Lattice& outline, int level);
/// Elements that its cells are made of.
std::size_t count_elements(const Reader& file, const Lattice& outline, int level);

/// All levels, with nothing but how they merge.
std::vector<Level> read_merges(const Reader& file);

/// What does not grow with the body: box, segments, materials, levels without cells, history.
Lattice read_outline(const Reader& file);

/// Children of a level's elements: within the finer level's, none in slots that the merge does not have.
/// @param values  as the file has them, eight for each element
std::vector<Children> to_children(const Reader& file, int level, const std::vector<std::int32_t>& values,
                                  const Index3& merge, std::size_t num_finer);

inline constexpr const char* gaps_name = "gaps";  ///< of levels' attributes that not all have

/// Datasets for the matrices of a level, whose rows come by write_matrices().
void declare_matrices(Writer& file, int level, std::size_t num_elements);
/// Where the material of each element is, beside its matrices.
void write_subcells(Writer& file, int level, const std::vector<SubcellMask>& subcells);
/// @param first  element of the first of these
void write_matrices(Writer& file, int level, std::size_t first, const StoredMatrices& matrices);
/// Rows of one of the sets of a level, which has so many elements.
std::vector<double> read_matrix_rows(const Reader& file, int level, const StoredMatrices::Set& set,
                                     std::size_t num_elements, std::size_t first, std::size_t count);

/// Whether the file holds the matrices of a level. @throws Error{input} if it holds some of them
bool has_matrices(const Reader& file, int level);

/// The matrices of a level, and from their volumes the voxels of each element.
/// @param numbers  sorted rows to read; nullptr = all
/// @throws Error{input} if they contradict each other
void read_matrices(const Reader& file, const Lattice& lattice, int number, Level& level,
                   const std::vector<std::int32_t>* numbers = nullptr);

/// The rows of sorted numbers within the dataset, read in blocks that hold some of them.
template <class T>
std::vector<T> read_selected_rows(const Reader& file, const std::string& name, hsize_t width,
                                  const std::vector<std::int32_t>& numbers) {
  const hsize_t block_rows = (hsize_t{1} << 19) / width;
  const hsize_t num_rows = file.shape(name, 2)[0];
  std::vector<T> out;
  out.reserve(width * numbers.size());
  for (std::size_t n = 0; n < numbers.size();) {
    const auto first = static_cast<hsize_t>(numbers[n]);
    const hsize_t count = std::min(block_rows, num_rows - first);
    const auto block = file.read_rows<T>(name, {0, width}, first, count);
    for (; n < numbers.size() && static_cast<hsize_t>(numbers[n]) < first + count; ++n) {
      const auto row = block.begin() + static_cast<std::ptrdiff_t>(width * (static_cast<hsize_t>(numbers[n]) - first));
      out.insert(out.end(), row, row + static_cast<std::ptrdiff_t>(width));
    }
  }
  return out;
}

}  // namespace hexmesh::hdf5
