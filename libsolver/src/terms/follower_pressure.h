// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "selection/selection.h"
#include "terms/load.h"

namespace hexsolver {

/// A pressure p that stays normal to the deformed surface and acts on its deformed area: forces -p n da, n da = cof(F)
/// dA (Nanson), at the four Gauss points of each face of a voxel, spread to the nodes by H^T.
///
/// With cells of trilinear displacement four points integrate the volume below a face,
///   W = p / 3 sum (x - c) . cof(F) dA,
/// and its derivative exactly: under a closed surface the forces are dW/du, have no resultant and no moment, and W is p
/// times the volume. Of a surface with a rim they are no gradient (Bufler, ZAMM 64 (1984) 287; Rumpel, Schweizerhof,
/// Int. J. Numer. Meth. Engng 57 (2003) 849), W is a measure only, and the symmetric part of the derivative is used.
class FollowerPressure final : public Load {
public:
  /// @param mesh       must outlive this
  /// @param faces      of voxels
  /// @param pressure   [MPa]
  /// @param is_closed  the faces have no rim
  FollowerPressure(std::string name, const Mesh& mesh, const std::vector<SurfacePoint>& faces, const Selector& selector,
                   double pressure, bool is_closed);

  EffectKind effect() const override { return EffectKind::force; }
  std::string name() const override { return name_; }
  void set_factor(const Vec3& factor) override;
  Vec3 total(const NodeVector& u) const override;
  double energy(const NodeVector& u) const override;
  void add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const override;
  bool is_linear() const override { return false; }
  bool is_conservative() const override { return is_closed_; }
  void linearize(const NodeVector& u, double projection) override;
  void add_product(const NodeVector& x, NodeVector& y) const override { add_product_of(x, y); }
  void add_product(const FloatNodeVector& x, FloatNodeVector& y) const override { add_product_of(x, y); }
  void add_cell_hessian(std::size_t cell, CellMatrix& h) const override;
  std::int32_t shared_hessian(std::size_t cell) const override;
  std::size_t bytes() const override;

private:
  struct Point {
    Vec3 local;  ///< in the cell
    Vec3 area;   ///< at rest, outward [mm^2]
  };
  struct Cell {
    std::size_t cell, begin, end;  ///< of points_
  };
  /// A point of a cell that is deformed by v.
  struct At {
    NodeWeights weights;
    hexmesh::NodeGradients gradients;  ///< at rest [1/mm]
    Mat3 f;                            ///< dx/dX
    Vec3 area;                         ///< cof(F) dA [mm^2]
  };
  At at(const Point& p, std::size_t cell, const CellVector& v) const;
  const Cell* find(std::size_t cell) const;
  template <class Vector>
  void add_product_of(const Vector& x, Vector& y) const;

  std::string name_;
  const Mesh& mesh_;
  double full_, pressure_;  ///< [MPa]
  bool is_closed_;
  Vec3 center_ = Vec3::Zero();  ///< of the faces at rest [mm]
  std::vector<Point> points_;
  std::vector<Cell> cells_;           ///< ascending
  std::vector<CellMatrix> hessians_;  ///< of cells_, of the last linearize(); empty: nothing
};

}  // namespace hexsolver
