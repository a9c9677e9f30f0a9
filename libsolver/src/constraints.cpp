// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/constraints.h"

#include <Eigen/Eigenvalues>
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/QR>
#include <Eigen/SparseCore>
#include <algorithm>
#include <map>
#include <set>

#include "hexmesh/core/partition.h"

namespace hexsolver {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using SparseMatrix = Eigen::SparseMatrix<double>;

/// Directions with sigma >= cutoff sigma_max of the rows whose Gram matrix is given: orthonormal vectors and sigma^2.
struct KeptDirections {
  MatrixXd vectors;
  VectorXd sigma2;
};

KeptDirections kept_directions(const MatrixXd& gram) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(gram);
  const VectorXd& values = eigen.eigenvalues();  // ascending
  const double least = Constraints::cutoff * Constraints::cutoff * values[values.size() - 1];
  const Index dropped = std::lower_bound(values.begin(), values.end(), least) - values.begin();
  const Index kept = values.size() - dropped;
  return {eigen.eigenvectors().rightCols(kept), values.tail(kept)};
}

/// f(node, weight) for each node that the point hangs on.
template <class F>
void for_each_weight(const Mesh& mesh, const ConstraintPoint& point, F&& f) {
  const CellNodes& nodes = mesh.cell_nodes()[static_cast<std::size_t>(point.cell)];
  for (int a = 0; a < 8; ++a)
    if (point.weights[a] != 0) f(nodes[static_cast<std::size_t>(a)], point.weights[a]);
}

}  // namespace

/// Points that hang together through shared nodes, along one axis: h^T h = vectors diag(sigma2) vectors^T + the rest.
struct Constraints::Cluster {
  std::vector<std::size_t> points;  ///< rows of h, numbers in held()
  std::vector<std::int32_t> nodes;  ///< columns of h
  SparseMatrix h;                   ///< (points, nodes)
  KeptDirections kept;
  /// One more direction v that holds as v.u = p.c: that in which forces that are the same on all points act beyond the
  /// kept ones, v = H^T p of length 1 and orthogonal to these; empty if there is none.
  VectorXd pressure_direction, pressure_forces;

  template <class Vector>
  VectorXd gather(const Vector& v, int axis) const {
    VectorXd out(static_cast<Index>(nodes.size()));
    for (std::size_t n = 0; n < nodes.size(); ++n)
      out[static_cast<Index>(n)] = static_cast<double>(v[3 * Index{nodes[n]} + axis]);
    return out;
  }

  /// The part of v in the span of the directions held.
  VectorXd into_span(const VectorXd& v) const {
    VectorXd part = kept.vectors * (kept.vectors.transpose() * v);
    if (pressure_direction.size() > 0) part += pressure_direction.dot(v) * pressure_direction;
    return part;
  }

  /// The smallest d that changes H u by `misfit` in the directions held.
  VectorXd displacement_for(const VectorXd& misfit) const {
    VectorXd d = solve_normal(h.transpose() * misfit);
    if (pressure_direction.size() > 0) d += pressure_forces.dot(misfit) * pressure_direction;
    return d;
  }

  /// Forces f on the points with H^T f = r, for r in the span.
  VectorXd forces_for(const VectorXd& r) const {
    VectorXd f = h * solve_normal(r);
    if (pressure_direction.size() > 0) f += pressure_direction.dot(r) * pressure_forces;
    return f;
  }

  Index num_directions() const { return kept.vectors.cols() + (pressure_direction.size() > 0); }

  /// V Sigma^-2 V^T
  VectorXd solve_normal(const VectorXd& b) const {
    return kept.vectors * (kept.vectors.transpose() * b).cwiseQuotient(kept.sigma2);
  }
};

namespace {

/// Numbers of the points that hang together along one axis.
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
  for (auto& [root, list] : members) clusters.push_back(std::move(list));
  return clusters;
}

std::vector<std::size_t> points_with_axis(const std::vector<ConstraintPoint>& points, std::size_t axis) {
  std::vector<std::size_t> used;
  for (std::size_t p = 0; p < points.size(); ++p)
    if (points[p].axes[axis]) used.push_back(p);
  return used;
}

/// The affine function a + b . x nearest to the prescribed values of some points along one axis; along directions in
/// which the points do not differ it is constant. Translations and rotations are affine.
class AffineFit {
public:
  AffineFit(const Mesh& mesh, const std::vector<ConstraintPoint>& points, const std::vector<std::size_t>& members,
            std::size_t axis) {
    for (const std::size_t m : members) center_ += position(mesh, points[m]) / static_cast<double>(members.size());
    MatrixXd rows(static_cast<Index>(members.size()), 4);
    VectorXd values(rows.rows());
    for (std::size_t n = 0; n < members.size(); ++n) {
      const auto row = static_cast<Index>(n);
      rows.row(row) << 1, (position(mesh, points[members[n]]) - center_).transpose();
      values[row] = points[members[n]].value[static_cast<Index>(axis)];
    }
    Eigen::CompleteOrthogonalDecomposition<MatrixXd> fit;
    fit.setThreshold(1e-9);
    coefficients_ = fit.compute(rows).solve(values);
  }
  double at(const Vec3& x) const { return coefficients_[0] + coefficients_.tail<3>().dot(x - center_); }

  static Vec3 position(const Mesh& mesh, const ConstraintPoint& point) {
    Vec3 x = Vec3::Zero();
    for_each_weight(mesh, point, [&](std::int32_t node, double weight) {
      x += weight * mesh.position(static_cast<std::size_t>(node));
    });
    return x;
  }

private:
  Vec3 center_ = Vec3::Zero();
  Eigen::Vector4d coefficients_;
};

/// Replace the points of clusters with too many nodes by the nodes themselves.
std::vector<ConstraintPoint> hold_large_clusters_by_nodes(const Mesh& mesh,
                                                          const std::vector<ConstraintPoint>& points) {
  struct NodeShare {
    double weight = 0, misfit = 0;
    std::map<std::int32_t, double> of_condition;
    std::int32_t cell = -1;
  };
  std::vector<ConstraintPoint> held = points;
  for (ConstraintPoint& p : held) p.axes = {false, false, false};
  std::map<std::int32_t, ConstraintPoint> by_node;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const auto& cluster : split_into_clusters(mesh, points, points_with_axis(points, axis))) {
      std::set<std::int32_t> nodes_of_cluster;
      for (const std::size_t p : cluster)
        for_each_weight(mesh, points[p], [&](std::int32_t node, double) { nodes_of_cluster.insert(node); });
      if (nodes_of_cluster.size() <= Constraints::dense_limit) {
        for (const std::size_t p : cluster) held[p].axes[axis] = true;
        continue;
      }
      const AffineFit fit(mesh, points, cluster, axis);
      std::map<std::int32_t, NodeShare> shares;
      for (const std::size_t p : cluster) {
        const double misfit = points[p].value[static_cast<Index>(axis)] - fit.at(AffineFit::position(mesh, points[p]));
        for_each_weight(mesh, points[p], [&](std::int32_t node, double weight) {
          NodeShare& s = shares[node];
          s.weight += weight;
          s.misfit += weight * misfit;
          s.of_condition[points[p].condition] += weight;
          s.cell = points[p].cell;
        });
      }
      double heaviest = 0;
      for (const auto& [node, s] : shares) heaviest = std::max(heaviest, s.weight);
      for (const auto& [node, s] : shares) {
        if (s.weight < Constraints::cutoff * heaviest) continue;
        ConstraintPoint& point =
            by_node.try_emplace(node, ConstraintPoint{0, s.cell, {}, Vec3::Zero(), {}}).first->second;
        const CellNodes& nodes = mesh.cell_nodes()[static_cast<std::size_t>(point.cell)];
        point.weights = NodeWeights::Unit(std::find(nodes.begin(), nodes.end(), node) - nodes.begin());
        point.condition = std::max_element(s.of_condition.begin(), s.of_condition.end(), [](auto& a, auto& b) {
                            return a.second < b.second;
                          })->first;
        point.axes[axis] = true;
        point.value[static_cast<Index>(axis)] =
            fit.at(mesh.position(static_cast<std::size_t>(node))) + s.misfit / s.weight;
      }
    }
  std::erase_if(held, [](const ConstraintPoint& p) { return !(p.axes[0] || p.axes[1] || p.axes[2]); });
  for (const auto& [node, point] : by_node) held.push_back(point);
  return held;
}

/// Where the points hold only some axes, as sliding plates and planes of symmetry do, a homogeneous stress may be the
/// solution: a uniform pressure on them has to find a support that balances it wholly. Patches held along all axes have
/// singular stresses at their rims instead, and one direction more would only pin corners of slivers.
bool needs_uniform_pressure(const Mesh& mesh, const std::vector<ConstraintPoint>& points,
                            const std::vector<std::size_t>& members) {
  constexpr double same_value = 1e-12;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto holds = [&](std::size_t p) { return points[p].axes[axis]; };
    if (!std::all_of(members.begin(), members.end(), holds)) continue;
    const AffineFit fit(mesh, points, members, axis);
    for (const std::size_t p : members) {
      const double value = points[p].value[static_cast<Index>(axis)];
      if (std::abs(value - fit.at(AffineFit::position(mesh, points[p]))) > same_value * std::max(1.0, std::abs(value)))
        return false;
    }
  }
  return std::any_of(members.begin(), members.end(), [&](std::size_t p) {
    const auto& axes = points[p].axes;
    return !(axes[0] && axes[1] && axes[2]);
  });
}

void hold_uniform_pressure(Constraints::Cluster& cluster) {
  constexpr double negligible = 1e-8;
  VectorXd forces = VectorXd::Ones(cluster.h.rows());
  const VectorXd whole = cluster.h.transpose() * forces;
  forces -= cluster.h * cluster.solve_normal(whole);
  const VectorXd rest = cluster.h.transpose() * forces;
  if (rest.norm() <= negligible * whole.norm()) return;
  cluster.pressure_direction = rest.normalized();
  cluster.pressure_forces = forces / rest.norm();
}

std::shared_ptr<const Constraints::Cluster> make_cluster(const Mesh& mesh, const std::vector<ConstraintPoint>& points,
                                                         std::vector<std::size_t> members) {
  auto cluster = std::make_shared<Constraints::Cluster>();
  cluster->points = std::move(members);
  std::map<std::int32_t, Index> column;
  for (const std::size_t p : cluster->points)
    for_each_weight(mesh, points[p], [&](std::int32_t node, double) { column[node] = 0; });
  for (auto& [node, number] : column) {
    number = static_cast<Index>(cluster->nodes.size());
    cluster->nodes.push_back(node);
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t row = 0; row < cluster->points.size(); ++row)
    for_each_weight(mesh, points[cluster->points[row]], [&](std::int32_t node, double weight) {
      entries.emplace_back(static_cast<Index>(row), column[node], weight);
    });
  cluster->h.resize(static_cast<Index>(cluster->points.size()), static_cast<Index>(cluster->nodes.size()));
  cluster->h.setFromTriplets(entries.begin(), entries.end());
  cluster->kept = kept_directions(MatrixXd(SparseMatrix(cluster->h.transpose()) * cluster->h));
  if (needs_uniform_pressure(mesh, points, cluster->points)) hold_uniform_pressure(*cluster);
  return cluster;
}

}  // namespace

Constraints::Constraints(const Mesh& mesh, std::vector<ConstraintPoint> points)
    : mesh_(mesh), points_(std::move(points)), held_(hold_large_clusters_by_nodes(mesh, points_)) {
  // Axes with the same points share their clusters.
  std::map<std::vector<std::size_t>, std::size_t> done;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<std::size_t> used = points_with_axis(held_, axis);
    if (const auto found = done.find(used); found != done.end()) {
      clusters_[axis] = clusters_[found->second];
      continue;
    }
    for (auto& members : split_into_clusters(mesh, held_, used))
      clusters_[axis].push_back(make_cluster(mesh, held_, std::move(members)));
    done[std::move(used)] = axis;
  }
}

Constraints::~Constraints() = default;

void Constraints::project(NodeVector& v) const { project_out(v); }
void Constraints::project(FloatNodeVector& v) const { project_out(v); }

template <class Vector>
void Constraints::project_out(Vector& v) const {
  for (int axis = 0; axis < 3; ++axis)
    for (const auto& cluster : clusters_[static_cast<std::size_t>(axis)]) {
      const VectorXd held = cluster->into_span(cluster->gather(v, axis));
      for (std::size_t n = 0; n < cluster->nodes.size(); ++n)
        v[3 * Index{cluster->nodes[n]} + axis] -= static_cast<typename Vector::Scalar>(held[static_cast<Index>(n)]);
    }
}

NodeVector Constraints::lift(const NodeVector& u, double fraction) const {
  NodeVector d = NodeVector::Zero(u.size());
  for (int axis = 0; axis < 3; ++axis)
    for (const auto& cluster : clusters_[static_cast<std::size_t>(axis)]) {
      VectorXd misfit = -(cluster->h * cluster->gather(u, axis));
      for (std::size_t p = 0; p < cluster->points.size(); ++p)
        misfit[static_cast<Index>(p)] += fraction * held_[cluster->points[p]].value[axis];
      const VectorXd correction = cluster->displacement_for(misfit);
      for (std::size_t n = 0; n < cluster->nodes.size(); ++n)
        d[3 * Index{cluster->nodes[n]} + axis] += correction[static_cast<Index>(n)];
    }
  return d;
}

std::vector<Vec3> Constraints::multipliers(const NodeVector& residual) const {
  std::vector<Vec3> forces(held_.size(), Vec3::Zero());
  for (int axis = 0; axis < 3; ++axis)
    for (const auto& cluster : clusters_[static_cast<std::size_t>(axis)]) {
      const VectorXd lambda = cluster->forces_for(cluster->gather(residual, axis));
      for (std::size_t p = 0; p < cluster->points.size(); ++p)
        forces[cluster->points[p]][axis] = lambda[static_cast<Index>(p)];
    }
  return forces;
}

Vec3 Constraints::displacement(const ConstraintPoint& point, const NodeVector& u) const {
  return mesh_.interpolate(point.cell, point.weights, u);
}

std::size_t Constraints::num_kept() const {
  std::size_t kept = 0;
  for (const auto& axis : clusters_)
    for (const auto& cluster : axis) kept += static_cast<std::size_t>(cluster->num_directions());
  return kept;
}

std::vector<std::size_t> Constraints::kept_by_condition(std::size_t num_conditions) const {
  std::vector<std::size_t> kept(num_conditions);
  for (const auto& axis : clusters_)
    for (const auto& cluster : axis) {
      std::vector<std::size_t> points(num_conditions);
      for (const std::size_t p : cluster->points) ++points[static_cast<std::size_t>(held_[p].condition)];
      const auto most = std::max_element(points.begin(), points.end()) - points.begin();
      kept[static_cast<std::size_t>(most)] += static_cast<std::size_t>(cluster->num_directions());
    }
  return kept;
}

std::vector<double> Constraints::contradiction() const {
  std::vector<Vec3> miss(held_.size(), Vec3::Zero());
  for (int axis = 0; axis < 3; ++axis)
    for (const auto& cluster : clusters_[static_cast<std::size_t>(axis)]) {
      VectorXd c(static_cast<Index>(cluster->points.size()));
      for (std::size_t p = 0; p < cluster->points.size(); ++p)
        c[static_cast<Index>(p)] = held_[cluster->points[p]].value[axis];
      if (c.maxCoeff() == c.minCoeff()) continue;  // a translation, which cells can always follow
      Eigen::LeastSquaresConjugateGradient<SparseMatrix> solver(cluster->h);
      solver.setTolerance(1e-10);
      solver.setMaxIterations(300);
      const VectorXd u = solver.solve(c);
      const VectorXd rest = c - cluster->h * u;
      for (std::size_t p = 0; p < cluster->points.size(); ++p)
        miss[cluster->points[p]][axis] = rest[static_cast<Index>(p)];
    }
  std::vector<double> distance;
  for (const Vec3& m : miss) distance.push_back(m.norm());
  return distance;
}

double Constraints::violation(const NodeVector& u, double fraction) const {
  return lift(u, fraction).lpNorm<Eigen::Infinity>();
}

}  // namespace hexsolver
