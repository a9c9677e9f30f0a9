// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "hdf5.h"
#include "hexmesh/lattice/lattice.h"

/// Whether what lattice and result files say of voxels and cells fits together. Each is linear in what it looks at, and
/// throws Error{input} naming dataset, place and what was expected.
namespace hexmesh::hdf5 {

/// "(i, j, k)", for messages.
std::string text_of(const Index3& index);

/// What a label stands for.
enum class LabelKind : std::uint8_t { unknown, without_material, with_material };
std::vector<LabelKind> kinds_of_labels(const std::vector<LatticeSegment>& segments);

/// Voxels of all segments with material.
std::size_t count_material(const std::vector<LatticeSegment>& segments);

/// Cells of one level, as a file has them.
struct StoredCells {
  std::string name;  ///< of the dataset
  std::span<const Index3> cells;
  Index3 voxels_per_cell = {1, 1, 1};
  bool are_all = true;  ///< every cell that holds material is there
};

/// They are sorted, each there once, or more often where cells may share an index.
void check_order(const Reader& file, const std::string& name, std::span<const Index3> cells, bool may_share = false);

/// The box ends where the body does; nothing to say where segments without material may be what it ends with.
void check_box(const Reader& file, const Grid& voxels, const std::vector<LatticeSegment>& segments,
               const StoredCells& cells);

/// Labels are those of segments; cells are where they are. @returns voxels of each label
std::vector<std::size_t> check_labels(const Reader& file, const Grid& voxels, std::span<const std::uint16_t> labels,
                                      const std::vector<LatticeSegment>& segments, const StoredCells& cells);

/// Segments with material have as many voxels as the file says.
void check_counts(const Reader& file, const std::vector<std::size_t>& of_label,
                  const std::vector<LatticeSegment>& segments);

/// Labels of cells or triangles are those of segments.
void check_segments(const Reader& file, const std::string& name, std::span<const std::uint16_t> segment,
                    const std::vector<LatticeSegment>& segments, LabelKind least);

}  // namespace hexmesh::hdf5
