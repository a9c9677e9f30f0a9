// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hexsolver/scene/scene.h"
#include "selection/selection.h"
#include "terms/point_hessians.h"

namespace hexsolver {

/// An obstacle without friction that surface points enter against springs: W = sum_p k/2 min(gap_p, 0)^2, the gap that
/// of the moved point, spread to the nodes by H^T.
class PenaltyContact final : public Term {
public:
  /// @param mesh    must outlive this
  /// @param points  the whole surface
  PenaltyContact(const Contact& contact, const Mesh& mesh, const std::vector<SurfacePoint>& points);

  EffectKind effect() const override { return EffectKind::contact; }
  std::string name() const override { return contact_name(contact_); }
  void set_progress(const Progress& progress);  ///< where the obstacle is
  double energy(const NodeVector& u) const override;
  void add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const override;
  bool is_linear() const override { return false; }
  void linearize(const NodeVector& u, double projection) override;
  void add_product(const NodeVector& x, NodeVector& y) const override { active_.add_product(x, y); }
  void add_product(const FloatNodeVector& x, FloatNodeVector& y) const override { active_.add_product(x, y); }
  void add_cell_hessian(std::size_t cell, CellMatrix& h) const override { active_.add_cell_hessian(cell, h); }
  std::int32_t shared_hessian(std::size_t cell) const override { return active_.shared_hessian(cell); }
  std::size_t bytes() const override;

  struct State {
    std::size_t points = 0;     ///< that touch
    double deepest = 0;         ///< [mm]
    double nearest = 0;         ///< least distance, < 0 inside [mm]
    Vec3 force = Vec3::Zero();  ///< on the body [N]
    bool is_inside = false;     ///< the centre of a ball lies in the body: it went through the surface
  };
  State state(const NodeVector& u) const;         ///< as the last set_progress() says
  State state_before(const NodeVector& u) const;  ///< before the obstacle has moved

  /// Points of the body at rest that the obstacle has in it on its way [mm].
  std::vector<Vec3> places_swept_at_rest() const;

  /// Whether a ball moves by more than a quarter of its radius, and might go through the surface.
  bool goes_too_far(const Progress& from, const Progress& to) const;

  /// The largest part of the load in one step that does not carry a ball through the surface.
  double largest_load_step() const;

private:
  struct Point {
    std::int32_t cell;
    NodeWeights weights;
    Vec3 rest;
    Vec3 area;  ///< outward, at rest
  };
  struct Gap {
    double depth = 0;    ///< < 0: inside the obstacle [mm]
    Vec3 normal;         ///< d depth / dx, out of it
    double bending = 0;  ///< d2 depth / dx2 = bending (1 - n n^T) [1/mm]
  };
  Vec3 moved_at(const Progress& progress) const;
  Gap gap(const Point& p, const NodeVector& u, const Vec3& moved) const;
  Gap gap(const Point& p, const NodeVector& u) const { return gap(p, u, moved_); }
  State state(const NodeVector& u, const Vec3& moved) const;
  Vec3 outward(const Point& p, const NodeVector& u) const;  ///< of the deformed surface, any length

  Contact contact_;
  const Mesh& mesh_;
  std::vector<Point> points_;  ///< ascending cells
  Vec3 moved_;                 ///< the obstacle, from where the scene puts it [mm]
  PointHessians active_;       ///< of the last linearize()
};

}  // namespace hexsolver
