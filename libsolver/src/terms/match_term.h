// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "match/matching.h"
#include "selection/selection.h"
#include "terms/point_hessians.h"

namespace hexsolver {

/// What a [[match]] asks, of points that move with their cells: W = part of the load * W_match(x + H u), to second
/// order about the places that the points had when they were last attached. A surface of triangles has a bend at each
/// edge, where no method that follows its distance comes to an end; one that is attached anew in rounds does.
class MatchTerm final : public Term {
public:
  /// @param mesh    must outlive this
  /// @param points  those of the matching, where they sit in the mesh
  /// @param pose    where the body begins
  MatchTerm(std::string name, std::shared_ptr<const Matching> matching, const Mesh& mesh,
            const std::vector<SurfacePoint>& points, const Eigen::Isometry3d& pose = Eigen::Isometry3d::Identity());

  EffectKind effect() const override { return EffectKind::match; }
  std::string name() const override { return name_; }
  void set_progress(const Progress& progress);
  double energy(const NodeVector& u) const override;
  void add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const override;

  /// Find what the points are pulled to from where they are. Before this nothing pulls.
  /// @param caution  0: with the second derivatives there; 1: with springs that bound the energy, so that it falls
  /// @param folding  cells whose points are pulled half as hard from now on; nothing: none
  void attach(const NodeVector& u, double caution, const std::vector<bool>& folding = {});
  void add_product(const NodeVector& x, NodeVector& y) const override { hessians_.add_product(x, y); }
  void add_product(const FloatNodeVector& x, FloatNodeVector& y) const override { hessians_.add_product(x, y); }
  void add_cell_hessian(std::size_t cell, CellMatrix& h) const override { hessians_.add_cell_hessian(cell, h); }
  std::int32_t shared_hessian(std::size_t cell) const override { return hessians_.shared_hessian(cell); }
  std::size_t bytes() const override;

  MatchReport report(const NodeVector& u) const;  ///< without what is of the start and of forces

private:
  std::vector<Vec3> places(const NodeVector& u) const;

  std::string name_;
  std::shared_ptr<const Matching> matching_;
  const Mesh& mesh_;
  Eigen::Isometry3d pose_;
  struct Point {
    std::int32_t cell;
    NodeWeights weights;
    std::size_t number;  ///< in the matching
  };
  std::vector<Point> points_;  ///< ascending cells
  double part_ = 1;            ///< of the load
  void set_hessians();

  PointHessians hessians_;
  std::vector<Vec3> attached_at_;  ///< places that pull_ is of
  Pull pull_;
  std::vector<double> part_of_;  ///< the pull of each point that is left to it
};

/// Where the points of each matching sit in a mesh.
using MatchedPoints = std::vector<std::vector<SurfacePoint>>;
MatchedPoints embed(const Matchings& matchings, Selector& selector);

/// Of each [[match]].
/// @param points  of its matching
/// @throws Error{geometry} for a landmark far from the body
std::vector<std::unique_ptr<MatchTerm>> make_match_terms(const Scene& scene, const Matchings& matchings,
                                                         const Mesh& mesh, const MatchedPoints& points);

}  // namespace hexsolver
