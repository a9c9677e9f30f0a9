// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/SparseCore>
#include <array>
#include <memory>
#include <vector>

#include "constraints/constraints.h"
#include "hexmesh/core/bytes.h"
#include "kernels/span_product.h"

namespace hexsolver {

/// Directions with sigma >= cutoff sigma_max of rows of h: of the columns of h S^-1 where these are scaled, S the sizes
/// of the cells around the nodes. Then nodes of small cells count as much as those of large ones.
struct KeptDirections {
  Eigen::MatrixXd vectors;  ///< orthonormal, of what is held: the singular vectors, or the span of S times these
  Eigen::VectorXd sigma2;
  /// Where the columns are scaled, of singular vectors v: S^-1 v, and what finds the coefficients of the smallest
  /// displacement; else empty.
  Eigen::MatrixXd divided, lifting;
};

/// f(free node, weight) for what takes part in a point; a node may come several times.
template <class F>
void for_each_weight(const Mesh& mesh, const ConstraintPoint& point, F&& f) {
  for (std::size_t a = 0; a < 8; ++a) {
    const double weight = point.weights[static_cast<Eigen::Index>(a)];
    if (weight != 0)
      mesh.for_each_free(static_cast<std::size_t>(point.cell), a,
                         [&](std::int32_t node, double part) { f(node, part * weight); });
  }
}

/// Points that share nodes, held along one axis: h^T h = vectors diag(sigma2) vectors^T + the rest.
struct ConstraintCluster {
  std::vector<std::size_t> points;  ///< rows of h, numbers in held()
  std::vector<std::int32_t> nodes;  ///< columns of h
  Eigen::VectorXd scale;            ///< of each row: the root of the part of a face that its point stands for
  Eigen::SparseMatrix<double> h;    ///< (points, nodes), rows scaled
  KeptDirections kept;
  /// One more direction v that holds as v.u = p.c: that in which forces that are the same on all points act beyond the
  /// kept ones, v = H^T p of length 1 and orthogonal to these; empty if there is none.
  Eigen::VectorXd pressure_direction, pressure_forces;

  /// The values of an axis at the nodes.
  template <class Vector>
  void gather(const Vector& v, int axis, Eigen::Ref<Eigen::VectorXd> out) const {
    for (std::size_t n = 0; n < nodes.size(); ++n) out[n] = static_cast<double>(v[3 * Eigen::Index{nodes[n]} + axis]);
  }

  /// The directions held, or those that are free where these are fewer: what a projection takes out, or leaves.
  struct {
    Span<double> doubles;
    Span<float> floats;
    bool is_of_free = false;
    const Span<double>& in(double) const { return doubles; }
    const Span<float>& in(float) const { return floats; }
  } span;

  /// Take out of each column of v, whose rows are filled up as the span's, its part along the directions held.
  /// @param v, part  shape (span rows, columns); part is space to work in
  template <class Scalar>
  void take_out_held(int columns, Scalar* v, Scalar* part) const {
    const Span<Scalar>& of = span.in(Scalar{});
    part_in_span(of, columns, v, part);
    for (std::size_t n = 0; n < of.rows * static_cast<std::size_t>(columns); ++n)
      v[n] = span.is_of_free ? part[n] : v[n] - part[n];
  }

  /// d = the smallest that changes H u by `misfit`, scaled, in the directions held.
  void displacement_for(const Eigen::Ref<const Eigen::VectorXd>& misfit, Eigen::Ref<Eigen::VectorXd> coefficients,
                        Eigen::Ref<Eigen::VectorXd> d) const {
    d.noalias() = h.transpose() * misfit;
    if (kept.lifting.size() > 0) {
      coefficients.noalias() = kept.lifting * d;
    } else {
      coefficients.noalias() = kept.vectors.transpose() * d;
      coefficients = coefficients.cwiseQuotient(kept.sigma2);
    }
    d.noalias() = kept.vectors * coefficients;
    if (pressure_direction.size() > 0) d += pressure_forces.dot(misfit) * pressure_direction;
  }

  /// Forces f on the points with H^T f = r, for r in the span.
  Eigen::VectorXd forces_for(const Eigen::VectorXd& r) const {
    Eigen::VectorXd f = h * solve_normal(r);
    if (pressure_direction.size() > 0) f += pressure_direction.dot(r) * pressure_forces;
    return f.cwiseProduct(scale);
  }

  /// Of the dense matrices, which take all but a little of the memory.
  std::size_t bytes() const {
    const Eigen::Index dense = kept.vectors.size() + kept.divided.size() + kept.lifting.size();
    return sizeof(double) * static_cast<std::size_t>(dense) + hexmesh::bytes_of(span.doubles.values) +
           hexmesh::bytes_of(span.floats.values);
  }

  Eigen::Index num_directions() const { return kept.vectors.cols() + (pressure_direction.size() > 0); }

  /// x with h^T h x = the part of b in the span: V Sigma^-2 V^T b
  Eigen::VectorXd solve_normal(const Eigen::VectorXd& b) const {
    const Eigen::VectorXd along = kept.vectors.transpose() * b;
    if (kept.divided.size() == 0) return kept.vectors * along.cwiseQuotient(kept.sigma2);
    return kept.divided * (kept.divided.transpose() * (kept.vectors * along)).cwiseQuotient(kept.sigma2);
  }
};

/// Numbers of those of some points that share nodes, directly or by way of others.
/// @param used  numbers of these points
std::vector<std::vector<std::size_t>> split_into_clusters(const Mesh& mesh, const std::vector<ConstraintPoint>& points,
                                                          const std::vector<std::size_t>& used);

/// Size of the cells around each node, the root of the mean square of their longest edges [mm]; empty where all are of
/// one size.
Eigen::VectorXd sizes_around(const Mesh& mesh, const std::vector<std::int32_t>& nodes);

/// Numbers of the points that are held along an axis.
std::vector<std::size_t> points_with_axis(const std::vector<ConstraintPoint>& points, std::size_t axis);

/// @param members  numbers of the points of the cluster
/// @param cutoff   of directions
/// @param in_mean  whether the mean displacement of the points is held in any case
std::shared_ptr<const ConstraintCluster> make_cluster(const Mesh& mesh, const std::vector<ConstraintPoint>& points,
                                                      std::vector<std::size_t> members, double cutoff, bool in_mean);

/// Clusters of each axis.
using ClustersByAxis = std::array<std::vector<std::shared_ptr<const ConstraintCluster>>, 3>;

/// How much of that rigid motion of the body the kept directions hold of which they hold least, over what all rows
/// hold of it: 1 where nothing is lost.
double least_part_of_rigid_motions(const Mesh& mesh, const ClustersByAxis& clusters);

}  // namespace hexsolver
