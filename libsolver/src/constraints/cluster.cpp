// SPDX-License-Identifier: Apache-2.0
#include "constraints/cluster.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <map>

#include "constraints/affine_fit.h"
#include "core/symmetric_eigen.h"
#include "hexmesh/core/partition.h"

namespace hexsolver {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using SparseMatrix = Eigen::SparseMatrix<double>;

namespace {

/// @param gram  of the rows
KeptDirections kept_directions(const MatrixXd& gram, double cutoff) {
  const SymmetricEigen eigen = symmetric_eigen(gram);
  const VectorXd& values = eigen.values;
  const double least = cutoff * cutoff * values[values.size() - 1];
  const Index dropped = std::lower_bound(values.begin(), values.end(), least) - values.begin();
  const Index kept = values.size() - dropped;
  return {eigen.vectors.rightCols(kept), values.tail(kept), {}, {}};
}

/// @param gram   of the rows
/// @param sizes  S
KeptDirections kept_scaled_directions(const MatrixXd& gram, const VectorXd& sizes, double cutoff) {
  const VectorXd inverse = sizes.cwiseInverse();
  KeptDirections kept = kept_directions(inverse.asDiagonal() * gram * inverse.asDiagonal(), cutoff);
  const MatrixXd functionals = sizes.asDiagonal() * kept.vectors;
  kept.divided = inverse.asDiagonal() * kept.vectors;
  const Eigen::HouseholderQR<MatrixXd> qr(functionals);
  const Index count = functionals.cols();
  kept.vectors = qr.householderQ() * MatrixXd::Identity(functionals.rows(), count);
  const MatrixXd right_sides = kept.sigma2.cwiseInverse().asDiagonal() * kept.divided.transpose();
  kept.lifting = qr.matrixQR().topRows(count).triangularView<Eigen::Upper>().transpose().solve(right_sides);
  return kept;
}

/// Where the points hold only some axes, as sliding plates and planes of symmetry do, a homogeneous stress may be the
/// solution: a uniform pressure on them has to find a support that balances it wholly. Patches held along all axes have
/// singular stresses at their rims instead, and one direction more would only pin corners of slivers.
bool needs_uniform_pressure(const Mesh& mesh, const std::vector<ConstraintPoint>& points,
                            const std::vector<std::size_t>& members) {
  const bool some_slide = std::any_of(members.begin(), members.end(), [&](std::size_t p) {
    const auto& axes = points[p].axes;
    return !(axes[0] && axes[1] && axes[2]);
  });
  if (!some_slide) return false;
  constexpr double same_value = 1e-12;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto holds = [&](std::size_t p) { return points[p].axes[axis]; };
    if (!std::all_of(members.begin(), members.end(), holds)) continue;
    const AffineFit fit(mesh, points, members);
    const AffineFit::Coefficients affine = fit.of(prescribed(points, members, axis));
    for (const std::size_t p : members) {
      const double value = points[p].value[axis];
      if (std::abs(value - fit.at(mesh.rest_position(points[p].cell, points[p].weights), affine)) >
          same_value * std::max(1.0, std::abs(value)))
        return false;
    }
  }
  return true;
}

void hold_uniform_pressure(ConstraintCluster& cluster) {
  constexpr double negligible = 1e-8;
  VectorXd forces = cluster.scale;
  const VectorXd whole = cluster.h.transpose() * forces;
  forces -= cluster.h * cluster.solve_normal(whole);
  const VectorXd rest = cluster.h.transpose() * forces;
  if (rest.norm() <= negligible * whole.norm()) return;
  cluster.pressure_direction = rest.normalized();
  cluster.pressure_forces = forces / rest.norm();
}

/// The rows of h by their part of the largest face.
void scale_rows(const std::vector<ConstraintPoint>& points, ConstraintCluster& cluster) {
  const auto face_of = [](const ConstraintPoint& p) { return p.is_quarter ? 4 * p.area : p.area; };
  double largest = 0;
  for (const std::size_t p : cluster.points) largest = std::max(largest, face_of(points[p]));
  cluster.scale.resize(cluster.points.size());
  for (std::size_t row = 0; row < cluster.points.size(); ++row) {
    const double area = points[cluster.points[row]].area;
    cluster.scale[row] = area > 0 ? std::sqrt(area / largest) : 1;
  }
}

/// Orthonormal directions that are orthogonal to some orthonormal ones.
MatrixXd complement(const MatrixXd& directions) {
  MatrixXd rest = MatrixXd::Zero(directions.rows(), directions.rows() - directions.cols());
  rest.bottomRows(rest.cols()).setIdentity();
  rest.applyOnTheLeft(Eigen::HouseholderQR<MatrixXd>(directions).householderQ());
  return rest;
}

/// The columns of h, the nodes of the points, and its entries.
void fill_rows(const Mesh& mesh, const std::vector<ConstraintPoint>& points, ConstraintCluster& cluster) {
  std::map<std::int32_t, Index> column;
  for (const std::size_t p : cluster.points)
    for_each_weight(mesh, points[p], [&](std::int32_t node, double) { column[node] = 0; });
  for (auto& [node, number] : column) {
    number = static_cast<Index>(cluster.nodes.size());
    cluster.nodes.push_back(node);
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t row = 0; row < cluster.points.size(); ++row)
    for_each_weight(mesh, points[cluster.points[row]], [&](std::int32_t node, double weight) {
      entries.emplace_back(static_cast<Index>(row), column[node], cluster.scale[row] * weight);
    });
  cluster.h.resize(cluster.points.size(), cluster.nodes.size());
  cluster.h.setFromTriplets(entries.begin(), entries.end());
}

}  // namespace

VectorXd sizes_around(const Mesh& mesh, const std::vector<std::int32_t>& nodes) {
  if (!mesh.is_graded()) return {};
  std::map<std::int32_t, std::pair<double, int>> squares;
  for (const std::int32_t n : nodes) squares[n] = {0, 0};
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    for (const std::int32_t n : mesh.cell_nodes()[c])
      if (const auto found = squares.find(n); found != squares.end()) {
        found->second.first += mesh.edges(c).colwise().squaredNorm().maxCoeff();
        ++found->second.second;
      }
  VectorXd sizes(static_cast<Index>(nodes.size()));
  for (Index n = 0; n < sizes.size(); ++n) {
    const auto& [sum, count] = squares.at(nodes[static_cast<std::size_t>(n)]);
    sizes[n] = std::sqrt(sum / count);
  }
  return sizes;
}

std::vector<std::vector<std::size_t>> split_into_clusters(const Mesh& mesh, const std::vector<ConstraintPoint>& points,
                                                          const std::vector<std::size_t>& used) {
  hexmesh::Partition partition(mesh.num_nodes());
  std::vector<std::int32_t> first(used.size(), -1);
  for (std::size_t n = 0; n < used.size(); ++n)
    for_each_weight(mesh, points[used[n]], [&](std::int32_t node, double) {
      if (first[n] < 0) first[n] = node;
      partition.join(first[n], node);
    });
  std::map<std::int32_t, std::vector<std::size_t>> members;
  for (std::size_t n = 0; n < used.size(); ++n) members[partition.root(first[n])].push_back(used[n]);
  std::vector<std::vector<std::size_t>> clusters;
  clusters.reserve(members.size());
  for (auto& [root, list] : members) clusters.push_back(std::move(list));
  return clusters;
}

std::vector<std::size_t> points_with_axis(const std::vector<ConstraintPoint>& points, std::size_t axis) {
  std::vector<std::size_t> used;
  for (std::size_t p = 0; p < points.size(); ++p)
    if (points[p].axes[axis]) used.push_back(p);
  return used;
}

std::shared_ptr<const ConstraintCluster> make_cluster(const Mesh& mesh, const std::vector<ConstraintPoint>& points,
                                                      std::vector<std::size_t> members, double cutoff, bool in_mean) {
  auto cluster = std::make_shared<ConstraintCluster>();
  cluster->points = std::move(members);
  scale_rows(points, *cluster);
  fill_rows(mesh, points, *cluster);
  const MatrixXd gram = SparseMatrix(cluster->h.transpose()) * cluster->h;
  const VectorXd sizes = sizes_around(mesh, cluster->nodes);
  cluster->kept = sizes.size() > 0 ? kept_scaled_directions(gram, sizes, cutoff) : kept_directions(gram, cutoff);
  if (in_mean || needs_uniform_pressure(mesh, points, cluster->points)) hold_uniform_pressure(*cluster);
  MatrixXd directions(cluster->h.cols(), cluster->num_directions());
  directions.leftCols(cluster->kept.vectors.cols()) = cluster->kept.vectors;
  if (cluster->pressure_direction.size() > 0) directions.rightCols(1) = cluster->pressure_direction;
  if (2 * directions.cols() > directions.rows()) {
    cluster->span.is_of_free = true;
    directions = complement(directions);
  }
  cluster->span.doubles.set(directions);
  cluster->span.floats.set(directions);
  return cluster;
}

double least_part_of_rigid_motions(const Mesh& mesh, const ClustersByAxis& clusters) {
  using Motions = Eigen::Matrix<double, 6, 6>;
  Vec3 center = Vec3::Zero();
  double count = 0;
  for (const auto& axis : clusters)
    for (const auto& cluster : axis)
      for (const std::int32_t node : cluster->nodes) {
        center += mesh.position(static_cast<std::size_t>(node));
        ++count;
      }
  if (count == 0) return 1;
  center /= count;
  const double size = mesh.edges().colwise().norm().maxCoeff();
  Motions all = Motions::Zero(), kept = Motions::Zero();
  for (int axis = 0; axis < 3; ++axis)
    for (const auto& cluster : clusters[static_cast<std::size_t>(axis)]) {
      MatrixXd motions(cluster->nodes.size(), 6);  // along the axis: t + w x (x - center) / size
      for (std::size_t n = 0; n < cluster->nodes.size(); ++n) {
        const Vec3 arm = (mesh.position(static_cast<std::size_t>(cluster->nodes[n])) - center) / size;
        const auto row = static_cast<Index>(n);
        for (int d = 0; d < 3; ++d) {
          motions(row, d) = d == axis;
          motions(row, 3 + d) = Vec3::Unit(d).cross(arm)[axis];
        }
      }
      const MatrixXd rows = cluster->h * motions;
      all += rows.transpose() * rows;
      // Of v.u, v a singular vector; where the columns are scaled v.S u = (S^-1 v).h^T h u / sigma^2.
      MatrixXd held = cluster->kept.vectors.transpose() * motions;
      if (cluster->kept.divided.size() > 0)
        held = cluster->kept.sigma2.cwiseInverse().asDiagonal() *
               (cluster->kept.divided.transpose() * (cluster->h.transpose() * rows));
      kept += held.transpose() * cluster->kept.sigma2.asDiagonal() * held;
    }
  const SymmetricEigen eigen = symmetric_eigen(all);
  const VectorXd& values = eigen.values;
  Index first = 0;
  while (first < 6 && values[first] <= 1e-9 * values[5]) ++first;  // what no row holds
  if (first == 6) return 1;
  const MatrixXd scaled =
      eigen.vectors.rightCols(6 - first) * values.tail(6 - first).cwiseSqrt().cwiseInverse().asDiagonal();
  return symmetric_eigen(scaled.transpose() * kept * scaled).values[0];
}

}  // namespace hexsolver
