// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "match/matching.h"
#include "selection/selection.h"
#include "terms/elastic.h"
#include "terms/point_hessians.h"

namespace hexsolver {

/// What a [[match]] asks, of points that move with their cells: W = part of the load * W_match(x + H u), to second
/// order about the places that the points had when they were last attached. A surface of triangles has a bend at each
/// edge, where no method that follows its distance comes to an end; one that is attached anew in rounds does.
class MatchTerm final : public Term {
public:
  /// @param mesh    must outlive this
  /// @param points  those of the matching, where they sit in the mesh; in cell -1: another process has it
  /// @param pose    where the body begins
  /// @param share   of the points; must outlive this. All processes call this, attach() and what asks distances at once
  MatchTerm(std::string name, std::shared_ptr<const Matching> matching, const Mesh& mesh,
            const std::vector<SurfacePoint>& points, const Eigen::Isometry3d& pose = Eigen::Isometry3d::Identity(),
            const SurfaceShare& share = SurfaceShare::of_one());

  EffectKind effect() const override { return EffectKind::match; }
  std::string name() const override { return name_; }
  void set_progress(const Progress& progress);
  double energy(const NodeVector& u) const override;
  void add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const override;

  /// Find what the points are pulled to from where they are. Before this nothing pulls.
  /// @param folding  cells whose points are pulled half as hard from now on; nothing: none
  void attach(const NodeVector& u, const PullMode& mode, const std::vector<bool>& folding = {});
  void add_product(const NodeVector& x, NodeVector& y) const override { hessians_.add_product(x, y); }
  void add_product(const FloatNodeVector& x, FloatNodeVector& y) const override { hessians_.add_product(x, y); }
  void add_cell_hessian(std::size_t cell, CellMatrix& h) const override { hessians_.add_cell_hessian(cell, h); }
  std::int32_t shared_hessian(std::size_t cell) const override { return hessians_.shared_hessian(cell); }
  std::size_t bytes() const override;

  std::optional<std::string> why_missed(const NodeVector& u) const { return matching_->why_missed(report(u)); }
  MatchReport report(const NodeVector& u) const;  ///< without what is of the start and of forces

private:
  std::vector<Vec3> places(const NodeVector& u) const;         ///< of all points
  Vec3 move_of(std::size_t point, const NodeVector& u) const;  ///< since it was attached; of points_

  std::string name_;
  std::shared_ptr<const Matching> matching_;
  const Mesh& mesh_;
  Eigen::Isometry3d pose_;
  const SurfaceShare& share_;
  bool is_first_;  ///< of the processes
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

/// Where the points of each matching sit in a mesh; in cell -1: nowhere near.
using MatchedPoints = std::vector<std::vector<SurfacePoint>>;
MatchedPoints embed(const Matchings& matchings, Selector& selector);

/// @throws Error{geometry} for a landmark far from the body
void expect_embedded(const Scene& scene, const Matchings& matchings, const MatchedPoints& points);

/// Of each [[match]].
/// @param points  of its matching
std::vector<std::unique_ptr<MatchTerm>> make_match_terms(const Scene& scene, const Matchings& matchings,
                                                         const Mesh& mesh, const MatchedPoints& points,
                                                         const SurfaceShare& share = SurfaceShare::of_one());

/// MatchTerm::attach() of all, of which points in cells that nearly fold are pulled less.
/// @param share_nodes  see cells_near_folds()
void attach(const std::vector<MatchTerm*>& matches, const ElasticCells& elastic, const NodeVector& u,
            const PullMode& mode, const std::function<void(std::vector<bool>&)>& share_nodes = {});

/// Why the body is not where some match asks it to be.
std::optional<std::string> why_missed(const std::vector<MatchTerm*>& matches, const NodeVector& u);

/// Fill report.matches, without forces, and warn of what is left out. @param start  where the body began
void report_matches(const std::vector<MatchTerm*>& matches, const NodeVector& start, const NodeVector& u,
                    SolveReport& report);

}  // namespace hexsolver
