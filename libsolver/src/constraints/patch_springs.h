// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "constraints/constraints.h"
#include "terms/elastic.h"
#include "terms/point_hessians.h"

namespace hexsolver {

/// What a patch of area A resists by, beside the directions that are kept, W = 1/2 sum_p k_p |H_p u - c_p|^2: what
/// varies within a cell along the patch is held as softly as the cell would give if it could follow as its voxels do. A
/// half-space gives way to tractions that alternate with the wavelength l by t / k, k = 2 pi mu / ((1 - nu) l) for each
/// area (Johnson, Contact Mechanics, 1985, 13.2); l = h - h_0, the cube roots of the volumes of the cell and of a
/// voxel, since voxels hold firmly; beside larger cells l = h_0 / 4.
class PatchSprings final : public Term {
public:
  /// The spring of a point of a patch in a cell [N/mm].
  /// @param edges  of the cell [mm]
  /// @param voxel  volume of a voxel of its lattice [mm^3]
  static double stiffness(const ConstraintPoint& point, const ElementModel& cell, const Mat3& edges, double voxel);

  /// @param points  with springs or without, which may come to be prescribed elsewhere; both must outlive this
  PatchSprings(const Mesh& mesh, const std::vector<ConstraintPoint>& points);

  EffectKind effect() const override { return EffectKind::elasticity; }
  std::string name() const override { return "supports"; }
  std::size_t bytes() const override { return hessians_.bytes(); }
  double energy(const NodeVector& u) const override;
  /// The work of what moves the patches, at u.
  /// @param way  of a point [mm]
  double work_of_motion(const NodeVector& u, const std::function<Vec3(const ConstraintPoint&)>& way) const;
  void add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const override;
  void add_product(const NodeVector& x, NodeVector& y) const override { hessians_.add_product(x, y); }
  void add_product(const FloatNodeVector& x, FloatNodeVector& y) const override { hessians_.add_product(x, y); }
  void add_cell_hessian(std::size_t cell, CellMatrix& h) const override { hessians_.add_cell_hessian(cell, h); }
  std::int32_t shared_hessian(std::size_t cell) const override { return hessians_.shared_hessian(cell); }

private:
  Vec3 pull(const ConstraintPoint& point, const NodeVector& u) const {  ///< of its spring on the body [N]
    return point.spring * (point.value - mesh_.interpolate(point.cell, point.weights, u));
  }

  const Mesh& mesh_;
  const std::vector<ConstraintPoint>& points_;
  PointHessians hessians_;
};

}  // namespace hexsolver
