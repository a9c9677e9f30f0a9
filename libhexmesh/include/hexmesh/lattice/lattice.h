// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hexmesh/lattice/element.h"
#include "hexmesh/lattice/material.h"
#include "hexmesh/lattice/merge.h"
#include "hexmesh/scan/label_volume.h"
#include "hexmesh/surface/triangle_surface.h"

namespace hexmesh {

/// A segment of the lattice. Without a material it is not solved on and only serves boundary conditions.
struct LatticeSegment {
  Segment segment;
  std::optional<Material> material;
  std::size_t num_voxels = 0;
};

/// The cells of one resolution. Level 0 = voxels; each next level merges two cells along some or all axes.
struct Level {
  Index3 merge = {1, 1, 1};            ///< cells of the finer level per cell along each axis
  Index3 voxels_per_cell = {1, 1, 1};  ///< level-0 cells per cell along each axis
  std::vector<Index3> cells;           ///< shape (num_cells), sorted, i fastest; index within the lattice's box
  std::vector<std::int32_t> element;   ///< shape (num_cells), into elements: cells alike share one
  std::vector<std::uint16_t> segment;  ///< shape (num_cells), label with most voxels in the cell
  std::vector<Element> elements;       ///< the distinct contents
};

/// The outer face of a material voxel, towards background or a segment without material.
struct ExposedFace {
  Index3 voxel;
  std::uint8_t side;        ///< 2 d for the lower, 2 d + 1 for the upper face along axis d
  std::uint16_t neighbour;  ///< label behind the face; 0 = background
};

/// A segmented body at every resolution.
struct Lattice {
  Grid voxels;                           ///< the box of all chosen segments at scan resolution
  std::vector<std::uint16_t> labels;     ///< shape (voxels.num_voxels()), 0 = background
  std::vector<LatticeSegment> segments;  ///< ascending by label
  std::vector<Level> levels;             ///< may hold only some levels when read from a file; the others are empty
  TriangleSurface surface;               ///< picture surface of every segment with material
  std::vector<std::string> history;      ///< command lines that made it, oldest first

  Vec3 cell_size(int level) const;   ///< edges of a cell [mm]
  Mat3 cell_edges(int level) const;  ///< columns = edge vectors in patient space [mm]
  Vec3 corner() const { return voxels.position(Vec3::Constant(-0.5)); }  ///< of the box; node (0, 0, 0) of every level
};

struct LatticeOptions {
  int num_levels = 0;         ///< 0: merge until at most 16 cells are left
  Index3 offset = {0, 0, 0};  ///< shift of the lattice against the body, in voxels; each >= 0
};

/// What a segment is made of, as asked by the user; without a value the named tissue default is taken.
struct MaterialChoice {
  bool none = false;  ///< the segment only serves boundary conditions
  std::optional<double> young_kpa, poisson, density_kg_m3;
};

/// Materials of all segments that occur in the volume.
/// @param choices  by segment name, "*" for all that are not named; a name that is not a segment is an error
/// @param notes    receives one line for each default that was taken
/// @throws Error{input} naming a segment without material or with one out of bounds
std::vector<LatticeSegment> assign_materials(const LabelVolume& volume,
                                             const std::map<std::string, MaterialChoice>& choices,
                                             std::vector<std::string>& notes);

/// Level 0 from the voxels with material, the others by merging: K_parent = sum_c L_c^T K_c L_c.
/// The surface stays empty (see surface/extract.h).
/// @throws Error{input} if no voxel has a material
Lattice build_lattice(const LabelVolume& volume, std::vector<LatticeSegment> segments,
                      const LatticeOptions& options = {});

/// The levels made anew from the lattice's voxels and its segments' materials, as many as it has.
Lattice rebuild_levels(Lattice lattice);

/// All exposed voxel faces, in the order of the voxels.
std::vector<ExposedFace> exposed_faces(const Lattice& lattice);

/// Centre of a face as a continuous voxel index.
Vec3 face_index(const ExposedFace& face);

}  // namespace hexmesh
