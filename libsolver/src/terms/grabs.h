// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <vector>

#include "selection/selection.h"
#include "terms/point_hessians.h"

namespace hexsolver {

/// Patches of the embedded surface that hands hold while the body moves: springs on their points, from where these were
/// when they were grasped and moved along by the hand, W = 1/2 sum_p k |H_p u - u_p - s|^2.
///
/// A hand is at s(t), straight within a step; it follows where it is asked to go at a bounded pace, so that a jump of
/// who asks is none of the body.
class Grabs final : public Term {
public:
  /// @param mesh           must outlive this
  /// @param most_per_step  how far a hand moves within a step [mm]
  Grabs(const Mesh& mesh, double most_per_step) : mesh_(mesh), most_per_step_(most_per_step), hessians_(mesh) {}

  bool holds(std::size_t hand) const { return hands_.contains(hand); }
  bool holds_any() const { return !hands_.empty(); }

  /// @param hand       free
  /// @param points     in cells of the mesh
  /// @param stiffness  of all points together [N/mm]
  void grasp(std::size_t hand, const std::vector<SurfacePoint>& points, double stiffness, const NodeVector& u);
  /// Where a hand is to go, from where it grasped [mm]. @pre it holds
  void pull(std::size_t hand, const Vec3& shift) { hands_.at(hand).asked = shift; }
  /// Of the first of its points when it was grasped [mm].
  const Vec3& displacement(std::size_t hand) const { return hands_.at(hand).points.front().grasped; }
  void let_go(std::size_t hand);
  void let_go();

  /// The hands move on from `begin` to `end` [s].
  void begin_step(double begin, double end);
  void set_time(double time);  ///< the hands are where they are then

  /// What the hands do to the body on their way between two times of a step, with the forces that they exert now at u
  /// [N mm].
  double work_of_motion(const NodeVector& u, double begin, double end) const;

  EffectKind effect() const override { return EffectKind::grab; }
  double energy(const NodeVector& u) const override;
  void add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const override;
  void add_product(const NodeVector& x, NodeVector& y) const override { hessians_.add_product(x, y); }
  void add_product(const FloatNodeVector& x, FloatNodeVector& y) const override { hessians_.add_product(x, y); }
  void add_cell_hessian(std::size_t cell, CellMatrix& h) const override { hessians_.add_cell_hessian(cell, h); }
  std::int32_t shared_hessian(std::size_t cell) const override { return hessians_.shared_hessian(cell); }
  std::size_t bytes() const override;

private:
  struct Point {
    std::int32_t cell;
    NodeWeights weights;
    double stiffness;  ///< [N/mm]
    Vec3 grasped;      ///< displacement then [mm]
  };
  struct Hand {
    std::vector<Point> points;
    Vec3 asked = Vec3::Zero(), from = Vec3::Zero(), to = Vec3::Zero();  ///< shifts: the last two of this step [mm]
  };
  Vec3 shift(const Hand& hand, double time) const;
  Vec3 stretch(const Point& point, const Vec3& shift, const NodeVector& u) const {
    return mesh_.interpolate(point.cell, point.weights, u) - point.grasped - shift;
  }
  void set_hessians();

  const Mesh& mesh_;
  double most_per_step_;
  std::map<std::size_t, Hand> hands_;
  double begin_ = 0, end_ = 0, time_ = 0;  ///< of the step, and now [s]
  PointHessians hessians_;
};

}  // namespace hexsolver
