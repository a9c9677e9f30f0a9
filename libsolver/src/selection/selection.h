// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "hexmesh/lattice/condensed_cells.h"
#include "hexmesh/lattice/locator.h"
#include "hexsolver/scene/scene.h"
#include "mesh/mesh_cells.h"

namespace hexsolver {

/// A point of the embedded surface, u(p) = H u.
struct SurfacePoint {
  std::int32_t cell = -1;    ///< of the mechanical level
  NodeWeights weights;       ///< of the cell's nodes
  Vec3 area = Vec3::Zero();  ///< outward area vector of an exposed face [mm^2]; zero for voxels and nodes
};

/// Which part of a surface a process has, and what all find together. Here: one process with all of it.
class SurfaceShare {
public:
  static const SurfaceShare& of_one() {
    static const SurfaceShare all;
    return all;
  }
  virtual ~SurfaceShare() = default;
  virtual bool has_voxel(const Index3& /*voxel*/) const { return true; }
  virtual bool has_node(const Index3& /*node*/) const { return true; }
  virtual double least(double value) const { return value; }  ///< of all processes
  virtual double sum(double value) const { return value; }
  virtual void add_up(std::vector<Vec3>& /*values*/) const {}
  virtual bool is_first(bool mine) const { return mine; }  ///< of the processes for which it is true
};

/// What acts at an index of voxels, on those whose centres are so near along each axis to another.
struct Acting {
  Vec3 index, center;
  double reach;
  bool in_all = false;  ///< in the middle of each of them instead: on what a node of cells holds
};

/// On which cells of level 0 that is.
/// @param voxels  of these, ascending
std::vector<hexmesh::ActingPoint> acting_points(const std::vector<Index3>& voxels, const std::vector<Acting>& acting);

/// Finds the surface points of one mechanical level that conditions and forces select.
class Selector {
public:
  /// All must outlive this.
  /// @param cells  of a lattice with faces or labels
  /// @param mesh   of these
  Selector(MeshCells cells, const Mesh& mesh, const SurfaceShare& share = SurfaceShare::of_one());
  ~Selector();

  /// @param what   named in messages, e.g. "condition 'hilum' (scene.toml:7:1)"
  /// @throws Error{geometry} for a selection without points, with the distance
  /// @throws Error{input} for a segment that the lattice does not have
  std::vector<SurfacePoint> select(const Selection& selection, const std::string& what);

  /// Where the displacement that a selection prescribes ends: the middles of the edges of its faces that no other of
  /// them has; of voxels and nodes these themselves [mm].
  std::vector<Vec3> rim(const Selection& selection, const std::string& what);

  /// Whether the finest cells have so many voxels that the middle of a face stands for all of it: 8 and more along each
  /// axis, where integrals of products of shape functions are within 1 %.
  bool has_small_faces() const;

  /// The level of the lattice that the cell of a point is of.
  int level_of(const SurfacePoint& point) const { return cells_.place(hexmesh::as_size(point.cell)).level; }

  /// The weights of the four Gauss points of a face.
  std::array<NodeWeights, 4> gauss_points(const SurfacePoint& face) const;

  const SurfaceShare& share() const noexcept { return share_; }

  /// Note from now on where all that is found acts.
  void note_what_acts() { notes_acting_ = true; }
  const std::vector<Acting>& acting() const noexcept { return acting_; }

  /// The centres of all exposed faces.
  std::vector<SurfacePoint> whole_surface();

  /// The centres of any faces of voxels that have a material.
  std::vector<SurfacePoint> centers_of(const std::vector<hexmesh::ExposedFace>& faces);

  /// Any places at rest, each in the cell that holds it or the nearest one; cell -1 where none is near.
  std::vector<SurfacePoint> embed(const std::vector<Vec3>& places);

private:
  struct Candidate;
  /// Those of the blocks of faces that may_count() of their balls; all nodes.
  template <class MayCount>
  std::vector<Candidate> candidates(SurfacePoints on, const MayCount& may_count);

  const hexmesh::Lattice& lattice() const noexcept { return cells_.lattice(); }
  const hexmesh::CellLocator& locator();  ///< @pre cells alike
  hexmesh::Embedding embed(const Index3& voxel, const Vec3& voxel_index) const;
  hexmesh::Embedding in_cell(std::int32_t cell, const Vec3& voxel_index) const;
  std::vector<Candidate> choose_candidates(const Selection& selection, const std::string& what);

  SurfacePoint found(const Candidate& candidate);
  void note_acting_around(const Candidate& node);  ///< in all that the cells beside it have
  /// @param reach  see Acting
  /// @param out    of a face, out of its voxel, along the axes of the voxels
  void note_acting(const Vec3& position, double reach, const Vec3& out = Vec3::Zero());

  MeshCells cells_;
  const Mesh& mesh_;
  const SurfaceShare& share_;
  bool notes_acting_ = false;
  std::vector<Acting> acting_;
  std::shared_ptr<const hexmesh::SurfaceFaces> faces_;   ///< found when first needed, as the next
  std::unique_ptr<const hexmesh::CellLocator> locator_;  ///< of cells of one level
};

}  // namespace hexsolver
