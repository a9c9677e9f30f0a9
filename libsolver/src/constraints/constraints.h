// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "mesh/mesh.h"

namespace hexsolver {

/// One point whose displacement is prescribed: H u = value along the chosen axes, H trilinear in its cell.
struct ConstraintPoint {
  std::int32_t condition = 0;  ///< which condition of the scene
  std::int32_t cell = -1;      ///< of the mechanical level
  NodeWeights weights;         ///< of the cell's nodes
  Vec3 value = Vec3::Zero();   ///< [mm]
  std::array<bool, 3> axes = {true, true, true};
  double area = 0;          ///< of a face, or a quarter of one, that it stands for [mm^2]; 0: it stands for itself
  bool is_quarter = false;  ///< one of a face's four Gauss points, which come one after the other
  bool is_soft = false;     ///< of a patch that has springs beside the directions kept (PatchSprings)
  int num_alike = 1;  ///< points in the same place, of conditions that hold one face: the spring is for all of them
  double spring = 0;  ///< its own [N/mm]
};

/// The same with one point for each face, in its middle.
std::vector<ConstraintPoint> with_face_centers(const std::vector<ConstraintPoint>& points);

struct ConstraintCluster;
class HeldNodes;
class SupportSprings;

/// What is held of a mesh as its preconditioners see it: of the mesh of one process, which shares nodes with others,
/// what its cells hold.
class HeldDirections {
public:
  virtual ~HeldDirections() = default;

  /// Points of the mesh's cells.
  virtual const std::vector<ConstraintPoint>& held() const noexcept = 0;

  /// v <- P v, P the orthogonal projection onto the displacements that leave all kept directions alone. Called by all
  /// processes at once.
  virtual void project(NodeVector& v) const = 0;
  virtual void project(FloatNodeVector& v) const = 0;

  /// Entries of 1 - P, the projection onto what is held: f(row, column, value), rows and columns of a NodeVector. Of a
  /// body that several processes have: of the whole, where the level is solved at once (Hierarchy).
  virtual void for_each_held_entry(const std::function<void(Eigen::Index, Eigen::Index, double)>& f) const = 0;

  /// Add to the springs of each condition what cells of other processes hold. Called by all processes at once.
  virtual void complete(std::vector<SupportSprings>& /*of_conditions*/) const {}
};

/// Prescribed displacements of embedded points, H u = c.
///
/// A patch pins more directions than a coarse cell has. Points that share nodes form a cluster; in each the right
/// singular vectors of H with sigma >= cutoff sigma_max are kept and hold exactly, the misfit of the others is least
/// squares: c' = H H^+ c as in the paper (whose two cases of H^+ are printed the wrong way round). Faces count by their
/// area, so that H^T H is the integral of N^T N over the patch, and their cutoff is 2/9, or less where the kept
/// directions would lose a rigid motion that the patches hold; for points it is a tenth (THEORY.md, "Constraints on the
/// embedded surface"). Where springs hold the others (PatchSprings) it is a half, or 0.85 of patches of many cells,
/// whose mean displacement is held as well. Where points hold only some axes (sliding plates, planes of symmetry) that
/// is held too, the direction in which a uniform pressure acts: a homogeneous stress is then in equilibrium with its
/// supports on every level. Clusters of more than
/// `dense_limit` nodes, where the singular vectors are too dear, hold their nodes themselves: those with at least 0.1
/// of the largest weight sum_p H_pn (0.85 where springs hold the rest), each where the affine fit of the prescribed
/// values (plus the mean misfit of its points) puts it.
class Constraints final : public HeldDirections {
public:
  static constexpr double cutoff_of_faces = 2.0 / 9, cutoff_of_points = 0.1;
  static constexpr double cutoff_of_soft_faces = 0.5, cutoff_of_large_soft_patches = 0.85;
  static constexpr double cells_of_large_patch = 16;  ///< at least: its area over that of a cell's face
  static constexpr std::size_t dense_limit = 1000;

  /// Where one point is soft all that share nodes with it are: fewer directions are kept there.
  Constraints(const Mesh& mesh, std::vector<ConstraintPoint> points);
  ~Constraints() override;

  /// The points asked for.
  const std::vector<ConstraintPoint>& points() const noexcept { return points_; }

  /// What is held in their place: the points of small clusters, the nodes of large ones and points that have springs
  /// alone.
  const std::vector<ConstraintPoint>& held() const noexcept override { return held_; }

  void project(NodeVector& v) const override;
  void project(FloatNodeVector& v) const override;
  void for_each_held_entry(const std::function<void(Eigen::Index, Eigen::Index, double)>& f) const override;

  /// Prescribe other displacements of points(), shape (num_points) [mm].
  void prescribe(const std::vector<Vec3>& values);

  /// d = the smallest such that u + d satisfies H (u + d) = c in the kept directions.
  void lift(const NodeVector& u, NodeVector& d) const;
  NodeVector lift(const NodeVector& u) const {
    NodeVector d;
    lift(u, d);
    return d;
  }

  /// Whether d = lift(u) is nothing beside the displacements there are.
  bool hold(const NodeVector& d, const NodeVector& u) const;

  bool are_soft() const;  ///< some points

  /// Give soft points their springs: `stiffness` of each [N/mm].
  void set_springs(const std::function<double(const ConstraintPoint&)>& stiffness);

  /// The forces on held() that balance the residual r = H^T lambda; shape (num_held) [N].
  std::vector<Vec3> multipliers(const NodeVector& residual) const;

  /// The same and those of springs at u.
  std::vector<Vec3> forces(const NodeVector& residual, const NodeVector& u) const;

  /// H u of a point [mm].
  Vec3 displacement(const ConstraintPoint& point, const NodeVector& u) const;

  std::size_t num_kept() const;  ///< directions, over all axes

  /// Directions held for each condition, over all axes; a cluster's count for the condition with most of its points.
  std::vector<std::size_t> kept_by_condition(std::size_t num_conditions) const;

  /// How far each of held() stays from its prescribed place however the nodes move: |c - H u| of the least-squares u
  /// without any cut-off, shape (num_held) [mm]. Not zero where the conditions are incompatible.
  std::vector<double> incompatibility() const;

  /// The largest nodal displacement that the kept directions still lack [mm].
  double violation(const NodeVector& u) const;

  std::size_t bytes() const;  ///< of memory

private:
  template <class Vector>
  void project_out(Vector& v) const;

  /// f(dof, displacement) of every node of the clusters, which share none.
  template <class F>
  void for_each_lifted(const NodeVector& u, F&& f) const;

  void hold_large_clusters_by_nodes();
  bool make_clusters(double part);  ///< of the cutoffs of faces; @returns whether some patches are large and soft

  const Mesh& mesh_;
  std::vector<ConstraintPoint> points_, held_;
  std::vector<std::size_t> own_point_;  ///< which of points() the first of held() are
  std::vector<HeldNodes> held_nodes_;   ///< of large clusters, the others of held()
  struct Work;
  std::unique_ptr<Work> work_;  ///< space for the vectors of a cluster
  std::array<std::vector<std::shared_ptr<const ConstraintCluster>>, 3> clusters_;  ///< per axis
  bool are_worth_threads_ = false;                                                 ///< to project on at once
};

}  // namespace hexsolver
