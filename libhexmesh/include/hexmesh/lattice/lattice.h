// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hexmesh/geometry/triangle_surface.h"
#include "hexmesh/lattice/element.h"
#include "hexmesh/lattice/material_rule.h"
#include "hexmesh/lattice/merge.h"
#include "hexmesh/lattice/split_cells.h"
#include "hexmesh/lattice/stored_matrices.h"
#include "hexmesh/lattice/subcells.h"
#include "hexmesh/lattice/surface_faces.h"
#include "hexmesh/volume/label_volume.h"

namespace hexmesh {

/// A segment of the lattice. Without a material it is not solved on and only serves boundary conditions.
struct LatticeSegment {
  Segment segment;
  std::optional<Material> material;  ///< the mean over its voxels where it follows the grey values
  std::size_t num_voxels = 0;
  std::string source;  ///< where the material's values come from
};

/// The segment of that name (case does not matter).
/// @throws Error{input} naming those that there are
const LatticeSegment& segment_named(const std::vector<LatticeSegment>& segments, const std::string& name);

/// What a full voxel may consist of.
struct VoxelMaterial {
  std::uint16_t label = 0;  ///< the segment it occurs in
  Material material;
};

/// Gaps between cells of level 1, as far as a coarser level has them open and some of them closed: cells that a gap
/// ends in hold both sides together. Areas over V^(2/3), V the volume of the material.
struct OpenGaps {
  double open = 0;
  double closed = 0;
  double closed_finer = 0;  ///< what the next finer level has closed of the same gaps
  bool operator==(const OpenGaps&) const = default;
};

/// The cells of one resolution. Level 0 = voxels; each next level merges two cells along some or all axes.
///
/// Cells alike share one element. An element is known by its children, the elements of the next finer level; those of
/// level 0 are the lattice's materials. Their integrals follow by recursion (see element_tree.h).
struct Level {
  Index3 merge = {1, 1, 1};            ///< cells of the finer level per cell along each axis
  Index3 voxels_per_cell = {1, 1, 1};  ///< level-0 cells per cell along each axis
  std::vector<Index3> cells;           ///< shape (num_cells), sorted, i fastest; index within the lattice's box
  SplitCells split;                    ///< where several stand at one index or do not share its node
  std::vector<std::int32_t> element;   ///< shape (num_cells), the element of each cell
  std::vector<std::uint16_t> segment;  ///< shape (num_cells), label with most voxels in the cell
  std::vector<std::uint16_t> parts;    ///< shape (num_cells), pieces of material in the cell (see parts.h)
  std::vector<Children> children;      ///< shape (num_elements), elements of the finer level by slot; empty at level 0
  std::vector<std::int64_t> filled;    ///< shape (num_elements), voxels with material
  std::vector<SubcellMask> subcells;   ///< shape (num_elements), those with material; 0 = not known
  double mixture = 0;                  ///< see count_mixture()
  OpenGaps gaps;                       ///< see measure_open_gaps()
  StoredMatrices matrices;             ///< of the elements, as read from a file that has them; empty: to be formed

  /// Filled part of a cell's volume, in (0, 1].
  double fill(std::size_t cell) const {
    const Index3& n = voxels_per_cell;
    return static_cast<double>(filled[element[cell]]) / (1.0 * n[0] * n[1] * n[2]);
  }
  bool is_boundary(std::size_t cell) const { return fill(cell) < 1; }
};

/// A segmented body at every resolution.
struct Lattice {
  Grid voxels;                           ///< the box of all chosen segments at scan resolution
  std::vector<std::uint16_t> labels;     ///< shape (voxels.num_voxels()), 0 = background; may be left out when read
  std::vector<LatticeSegment> segments;  ///< ascending by label
  std::vector<VoxelMaterial> materials;  ///< what voxels consist of: the elements of level 0
  std::vector<Level> levels;             ///< may hold only some levels when read from a file; the others are empty
  TriangleSurface surface;               ///< picture surfaces, bound to the cells by their positions; likewise
  std::vector<std::string> history;      ///< command lines that made it, oldest first
  Parting parting;                       ///< what its cells keep apart; nothing where no level is split
  bool surface_of_voxels = false;        ///< `surface` is what extract_surfaces() makes (see surface/extract.h)
  std::shared_ptr<const SurfaceFaces> faces;  ///< of the labels; ask faces_of()

  /// One of `levels`. @pre 0 <= n < num_levels()
  Level& level(int n) { return levels[as_size(n)]; }
  const Level& level(int n) const { return levels[as_size(n)]; }
  int num_levels() const { return static_cast<int>(levels.size()); }

  Vec3 cell_size(int level) const;   ///< edges of a cell [mm]
  Mat3 cell_edges(int level) const;  ///< columns = edge vectors in patient space [mm]
  Vec3 corner() const { return voxels.position(Vec3::Constant(-0.5)); }  ///< of the box; node (0, 0, 0) of every level
};

/// Memory that a lattice takes.
std::size_t bytes_of(const Lattice& lattice);

struct LatticeOptions {
  int num_levels = 0;            ///< 0: merge until at most 16 cells are left
  Index3 offset = {0, 0, 0};     ///< shift of the lattice against the body, in voxels; each >= 0
  Parting parting = {true, {}};  ///< what cells keep apart; labels that no two segments with material have part nothing
};

/// Level 0 from the voxels with material, the others by merging: K_parent = sum_c L_c^T K_c L_c.
/// The surface stays empty (see surface/extract.h).
/// @param grey  the segments whose material follows the grey values; none if nullptr
/// @throws Error{input} if no voxel has a material, or naming a segment whose material is out of bounds
Lattice build_lattice(const LabelVolume& volume, std::vector<LatticeSegment> segments,
                      const LatticeOptions& options = {}, const GreyMaterials* grey = nullptr);

/// The nodes of the cells of a level.
NodeNumbering nodes_of(const Level& level);

/// The cell of a coarser level that holds one of a level.
/// @pre both levels are there
std::int32_t coarser_cell_of(const Lattice& lattice, int level, std::int32_t cell, int coarser);

/// Of each cell of a level, the cell of a coarser one that holds it.
/// @pre both levels are there
std::vector<std::int32_t> coarser_cells_of(const Lattice& lattice, int level, int coarser);

/// The same voxels, materials and element numbers at level 0 with all levels made anew, as many as there were.
/// @pre level 0 is there
Lattice build_levels(Lattice lattice);

/// The same body without the voxels of some cells of a level; all levels are made anew.
/// @pre level 0 is there; some voxel is left
Lattice without_cells(Lattice lattice, int level, const std::vector<std::int32_t>& cells);

/// Voxels and subcells with material per element of each level, from the children.
void count_filled(std::vector<Level>& levels, std::size_t num_materials);

/// How different the stiffnesses are that cells of each level average over: <mu> <1/mu> - 1 of a cell's voxels, the
/// upper bound of its shear modulus over the lower one less 1, averaged over the material. 0: of one stiffness in each
/// cell. Levels without cells keep what they have.
/// @pre levels with cells have the children of all finer ones
void count_mixture(std::vector<Level>& levels, const std::vector<VoxelMaterial>& materials);

enum class VoxelClass : std::uint8_t { outside, inside, boundary };  ///< boundary: material with an exposed face

/// Class of each voxel of the lattice's box; cells are inside or boundary by Level::is_boundary.
std::vector<VoxelClass> classify_voxels(const Lattice& lattice);

/// Faces of voxels, in the order of the voxels. Beyond the box there is background, 0.
/// @param of, towards  by label, shape (65536): of which voxels, and what is beside them
/// @pre the lattice has labels
std::vector<ExposedFace> faces_between(const Lattice& lattice, const std::vector<bool>& of,
                                       const std::vector<bool>& towards);

/// The exposed voxel faces: those it has, else found from its labels.
std::shared_ptr<const SurfaceFaces> faces_of(const Lattice& lattice);

/// All of them, in the order of the voxels.
std::vector<ExposedFace> exposed_faces(const Lattice& lattice);

}  // namespace hexmesh
