// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <span>
#include <vector>

#include "hexmesh/lattice/locator.h"
#include "mesh/mesh_cells.h"
#include "terms/bins.h"

namespace hexsolver {

/// Where places in space are in the rest shape of a segment that is deformed: the inverse of x = X + u(X), cell by
/// cell. Continued a little beyond the outermost cells.
class BodyMap {
public:
  /// @param cells  of a lattice with labels, which must outlive this
  /// @param mesh   of these; must outlive this
  /// @param of     whether a label is of the segment, shape (65536)
  BodyMap(const MeshCells& cells, const Mesh& mesh, const std::vector<bool>& of);

  struct Place {
    std::int32_t cell = -1;                     ///< < 0: no cell of the segment is there
    Vec3 local = Vec3::Zero();                  ///< in the cell, [0, 1]^3 inside
    Vec3 rest = Vec3::Zero();                   ///< X [mm]
    Mat3 to_rest = Mat3::Zero();                ///< dX/dx = F^-1
    NodeWeights weights = NodeWeights::Zero();  ///< of the cell's nodes there
  };

  /// What the point is of: its place is not in its own cell, which small pieces of the segment may move with, nor in
  /// one that shares a node with that; of the segment itself nor beyond a cell where the point is at rest.
  struct Own {
    std::int32_t cell;
    Vec3 rest;  ///< [mm]
    bool is_of_segment;
  };
  /// How far outside a place is in the rest shape [mm]; < 0 inside.
  using Depth = std::function<double(const Place&)>;

  /// Of the places that cells have for x, which look_at() found near it, that of the nearest, unless others are inside:
  /// then the deepest.
  /// @param near   a cell to begin at and where in it, as of a displacement not far from u, whose place counts as the
  ///               nearest and is taken at once where it is inside; cell < 0: none
  /// @param own    nullptr: of no cell
  Place find(const Vec3& x, const NodeVector& u, const hexmesh::Embedding& near, const Own* own,
             const Depth& depth) const;

  /// By the map of one cell, which goes on beyond it; cell < 0: not so far.
  Place place_in(const Vec3& x, const NodeVector& u, const hexmesh::Embedding& near) const;

  /// How a place bends with the cell: see PenaltyContact.
  struct Bending {
    NodeGradients gradients;  ///< of the shape functions, by the place in space [1/mm]
    Mat3 second;              ///< of m . x, by X twice
  };
  Bending bending(std::int32_t cell, const Vec3& local, const NodeVector& u, const Vec3& m) const;

  /// Of a place on the border of its cell, about, the derivatives that those beyond have there.
  std::vector<Mat3> to_rest_beside(std::int32_t cell, const Vec3& local, const NodeVector& u) const;

  /// Remember where the cells are, for find().
  void look_at(const NodeVector& u);

  std::size_t bytes() const;

private:
  /// Of cells of a size.
  struct OfSize {
    Vec3 voxel = Vec3::Zero();  ///< in edges of a cell
    double beyond_most = 0;     ///< how far the map of an outermost cell goes on, in its edges
    double edge = 0;            ///< of a cell, the longest [mm]
  };
  enum class End {
    found,
    left,
    far,
    failed
  };  ///< of a cell's inverse map; left: it ends outside; far: or goes on there
  End invert(const Vec3& x, const NodeVector& u, std::int32_t cell, Vec3& local) const;
  Place walk(const Vec3& x, const NodeVector& u, const hexmesh::Embedding& from) const;
  Place place(const NodeVector& u, std::int32_t cell, const Vec3& local) const;
  std::span<const std::int32_t> beyond(std::int32_t cell, int side) const;
  Vec3 local_in(std::int32_t other, std::int32_t cell, const Vec3& local) const;  ///< of a place in a cell
  const OfSize& size_of(std::int32_t cell) const { return sizes_[mesh_.size_of(hexmesh::as_size(cell))]; }
  bool touch(std::int32_t one, std::int32_t other) const;  ///< whether two cells share a node
  /// Whether a place is one of its cell's: where it has the cell to itself, or voxels of the segment near it are of
  /// that or of one that touches it, or there are none.
  bool is_of_segment(const Place& place) const;
  template <class F>
  bool for_holders_near(const Vec3& rest, const F& f) const;
  bool is_elsewhere(const Place& place, const Own& own) const;

  const MeshCells cells_of_;
  const Mesh& mesh_;
  const std::vector<bool> of_;
  Vec3 corner_;
  std::vector<bool> holds_;                 ///< of each cell of the mesh, whether it holds voxels of the segment
  std::vector<std::int32_t> cells_;         ///< those that do
  std::vector<bool> shares_index_;          ///< of each cell, whether another one of these stands at its index
  std::vector<std::int32_t> beyond_begin_;  ///< by 6 cell + side, rows of
  std::vector<std::int32_t> beyond_;        ///< those behind the faces of cells
  std::vector<Eigen::AlignedBox3d> boxes_;  ///< of cells_, as look_at() found them
  Bins bins_;                               ///< of boxes_
  std::vector<OfSize> sizes_;               ///< of cells of the mesh
};

}  // namespace hexsolver
