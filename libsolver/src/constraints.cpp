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
#include "parallel.h"

namespace hexsolver {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using SparseMatrix = Eigen::SparseMatrix<double>;
template <class Scalar>
using MatrixOf = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

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

  /// The values of an axis at the nodes.
  template <class Vector>
  void gather(const Vector& v, int axis, Eigen::Ref<VectorXd> out) const {
    for (std::size_t n = 0; n < nodes.size(); ++n)
      out[static_cast<Index>(n)] = static_cast<double>(v[3 * Index{nodes[n]} + axis]);
  }

  /// All directions held, in single precision: what takes part in V-cycles.
  Eigen::MatrixXf single_directions;

  /// Of each column of v, the part in the span of the directions held. Each direction is read once.
  template <class Scalar>
  void into_span(const Eigen::Ref<const MatrixOf<Scalar>>& v, Eigen::Ref<MatrixOf<Scalar>> part) const {
    const auto add_along = [&](const auto& direction) {
      for (Index column = 0; column < v.cols(); ++column) part.col(column) += direction.dot(v.col(column)) * direction;
    };
    part.setZero();
    if constexpr (std::is_same_v<Scalar, float>) {
      for (Index n = 0; n < single_directions.cols(); ++n) add_along(single_directions.col(n));
    } else {
      for (Index n = 0; n < kept.vectors.cols(); ++n) add_along(kept.vectors.col(n));
      if (pressure_direction.size() > 0) add_along(pressure_direction);
    }
  }

  /// d = the smallest that changes H u by `misfit` in the directions held.
  void displacement_for(const Eigen::Ref<const VectorXd>& misfit, Eigen::Ref<VectorXd> coefficients,
                        Eigen::Ref<VectorXd> d) const {
    d.noalias() = h.transpose() * misfit;
    coefficients.noalias() = kept.vectors.transpose() * d;
    coefficients = coefficients.cwiseQuotient(kept.sigma2);
    d.noalias() = kept.vectors * coefficients;
    if (pressure_direction.size() > 0) d += pressure_forces.dot(misfit) * pressure_direction;
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

/// The affine functions a + b . x nearest to values given at some points; along directions in which the points do not
/// differ they are constant. Translations and rotations are affine.
class AffineFit {
public:
  AffineFit(const Mesh& mesh, const std::vector<ConstraintPoint>& points, const std::vector<std::size_t>& members) {
    for (const std::size_t m : members)
      center_ += mesh.rest_position(points[m].cell, points[m].weights) / static_cast<double>(members.size());
    MatrixXd rows(static_cast<Index>(members.size()), 4);
    for (std::size_t n = 0; n < members.size(); ++n)
      rows.row(static_cast<Index>(n)) << 1,
          (mesh.rest_position(points[members[n]].cell, points[members[n]].weights) - center_).transpose();
    fit_.setThreshold(1e-9);
    fit_.compute(rows);
  }

  using Coefficients = Eigen::Vector4d;
  Coefficients of(const VectorXd& values) const { return fit_.solve(values); }
  double at(const Vec3& x, const Coefficients& c) const { return c[0] + c.tail<3>().dot(x - center_); }

private:
  Vec3 center_ = Vec3::Zero();
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> fit_;
};

VectorXd prescribed(const std::vector<ConstraintPoint>& points, const std::vector<std::size_t>& members,
                    std::size_t axis) {
  VectorXd values(static_cast<Index>(members.size()));
  for (std::size_t n = 0; n < members.size(); ++n)
    values[static_cast<Index>(n)] = points[members[n]].value[static_cast<Index>(axis)];
  return values;
}

}  // namespace

/// The nodes that are held in place of the points of a cluster with too many nodes, along one axis: each where the
/// affine fit of the points, and the mean misfit of its own, puts it.
class Constraints::HeldNodes {
public:
  HeldNodes(const Mesh& mesh, const std::vector<ConstraintPoint>& points, std::vector<std::size_t> members,
            std::size_t axis)
      : mesh_(&mesh), members_(std::move(members)), axis_(axis), fit_(mesh, points, members_) {
    std::map<std::int32_t, Node> nodes;
    for (std::size_t n = 0; n < members_.size(); ++n) {
      const ConstraintPoint& p = points[members_[n]];
      for_each_weight(mesh, p, [&](std::int32_t node, double weight) {
        Node& of = nodes[node];
        of.points.emplace_back(n, weight);
        of.weight += weight;
        of.of_condition[p.condition] += weight;
        of.cell = p.cell;
      });
    }
    double heaviest = 0;
    for (const auto& [node, of] : nodes) heaviest = std::max(heaviest, of.weight);
    for (auto& [node, of] : nodes)
      if (of.weight >= cutoff * heaviest) nodes_.emplace_back(node, std::move(of));
  }

  /// Add the nodes to those that are held, or the axis to those that are.
  void hold(std::map<std::int32_t, ConstraintPoint>& held) const {
    for (const auto& [node, of] : nodes_) {
      ConstraintPoint& point = held.try_emplace(node, ConstraintPoint{0, of.cell, {}, Vec3::Zero(), {}}).first->second;
      const CellNodes& corners = mesh_->cell_nodes()[static_cast<std::size_t>(point.cell)];
      point.weights = NodeWeights::Unit(std::find(corners.begin(), corners.end(), node) - corners.begin());
      point.condition = std::max_element(of.of_condition.begin(), of.of_condition.end(), [](auto& a, auto& b) {
                          return a.second < b.second;
                        })->first;
      point.axes[axis_] = true;
    }
  }

  /// @param number  of each node among `held`
  void find(const std::map<std::int32_t, std::size_t>& number) {
    for (auto& [node, of] : nodes_) of.held = number.at(node);
  }

  void prescribe(const std::vector<ConstraintPoint>& points, std::vector<ConstraintPoint>& held) const {
    const VectorXd values = prescribed(points, members_, axis_);
    const AffineFit::Coefficients affine = fit_.of(values);
    VectorXd misfit = values;
    for (std::size_t n = 0; n < members_.size(); ++n)
      misfit[static_cast<Index>(n)] -=
          fit_.at(mesh_->rest_position(points[members_[n]].cell, points[members_[n]].weights), affine);
    for (const auto& [node, of] : nodes_) {
      double mean = 0;
      for (const auto& [n, weight] : of.points) mean += weight / of.weight * misfit[static_cast<Index>(n)];
      held[of.held].value[static_cast<Index>(axis_)] =
          fit_.at(mesh_->position(static_cast<std::size_t>(node)), affine) + mean;
    }
  }

private:
  struct Node {
    std::vector<std::pair<std::size_t, double>> points;  ///< numbers in members_, weights
    double weight = 0;                                   ///< their sum
    std::map<std::int32_t, double> of_condition;
    std::int32_t cell = -1;
    std::size_t held = 0;  ///< number in held()
  };
  const Mesh* mesh_;
  std::vector<std::size_t> members_;
  std::size_t axis_;
  AffineFit fit_;
  std::vector<std::pair<std::int32_t, Node>> nodes_;
};

/// Replace the points of clusters with too many nodes by the nodes themselves.
void Constraints::hold_large_clusters_by_nodes() {
  std::vector<std::array<bool, 3>> axes(points_.size(), {false, false, false});
  std::map<std::int32_t, ConstraintPoint> by_node;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (auto& cluster : split_into_clusters(mesh_, points_, points_with_axis(points_, axis))) {
      std::set<std::int32_t> nodes_of_cluster;
      for (const std::size_t p : cluster)
        for_each_weight(mesh_, points_[p], [&](std::int32_t node, double) { nodes_of_cluster.insert(node); });
      if (nodes_of_cluster.size() <= dense_limit) {
        for (const std::size_t p : cluster) axes[p][axis] = true;
        continue;
      }
      held_nodes_.emplace_back(mesh_, points_, std::move(cluster), axis);
      held_nodes_.back().hold(by_node);
    }
  for (std::size_t p = 0; p < points_.size(); ++p) {
    if (!(axes[p][0] || axes[p][1] || axes[p][2])) continue;
    own_point_.push_back(p);
    held_.push_back(points_[p]);
    held_.back().axes = axes[p];
  }
  std::map<std::int32_t, std::size_t> number;
  for (const auto& [node, point] : by_node) {
    number[node] = held_.size();
    held_.push_back(point);
  }
  for (HeldNodes& nodes : held_nodes_) {
    nodes.find(number);
    nodes.prescribe(points_, held_);
  }
}

namespace {

/// Where the points hold only some axes, as sliding plates and planes of symmetry do, a homogeneous stress may be the
/// solution: a uniform pressure on them has to find a support that balances it wholly. Patches held along all axes have
/// singular stresses at their rims instead, and one direction more would only pin corners of slivers.
bool needs_uniform_pressure(const Mesh& mesh, const std::vector<ConstraintPoint>& points,
                            const std::vector<std::size_t>& members) {
  constexpr double same_value = 1e-12;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto holds = [&](std::size_t p) { return points[p].axes[axis]; };
    if (!std::all_of(members.begin(), members.end(), holds)) continue;
    const AffineFit fit(mesh, points, members);
    const AffineFit::Coefficients affine = fit.of(prescribed(points, members, axis));
    for (const std::size_t p : members) {
      const double value = points[p].value[static_cast<Index>(axis)];
      if (std::abs(value - fit.at(mesh.rest_position(points[p].cell, points[p].weights), affine)) >
          same_value * std::max(1.0, std::abs(value)))
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
  MatrixXd directions(cluster->h.cols(), cluster->num_directions());
  directions.leftCols(cluster->kept.vectors.cols()) = cluster->kept.vectors;
  if (cluster->pressure_direction.size() > 0) directions.rightCols(1) = cluster->pressure_direction;
  cluster->single_directions = directions.cast<float>();
  return cluster;
}

}  // namespace

struct Constraints::Work {
  VectorXd nodal, coefficients, misfit;
  /// Of the nodes of each cluster, axes as columns: clusters are worked on at once.
  template <class Scalar>
  struct ByAxis {
    MatrixOf<Scalar> nodal, held;
  };
  std::vector<ByAxis<double>> doubles;
  std::vector<ByAxis<float>> floats;
  std::vector<ByAxis<double>>& by_axis(double) { return doubles; }
  std::vector<ByAxis<float>>& by_axis(float) { return floats; }
};

Constraints::Constraints(const Mesh& mesh, std::vector<ConstraintPoint> points)
    : mesh_(mesh), points_(std::move(points)), work_(std::make_unique<Work>()) {
  hold_large_clusters_by_nodes();
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
  Index most_nodes = 0, most_points = 0, num_entries = 0;
  for (const auto& axis : clusters_)
    for (const auto& cluster : axis) {
      most_nodes = std::max(most_nodes, cluster->h.cols());
      most_points = std::max(most_points, cluster->h.rows());
      num_entries += cluster->kept.vectors.size();
    }
  work_->nodal.resize(most_nodes);
  for (const auto& axis : clusters_) {
    work_->doubles.resize(std::max(work_->doubles.size(), axis.size()));
    for (std::size_t n = 0; n < axis.size(); ++n) {
      MatrixXd& nodal = work_->doubles[n].nodal;
      nodal.setZero(std::max(nodal.rows(), axis[n]->h.cols()), 3);
      work_->doubles[n].held = nodal;
    }
  }
  for (const auto& of_cluster : work_->doubles)
    work_->floats.push_back({of_cluster.nodal.cast<float>(), of_cluster.held.cast<float>()});
  work_->coefficients.resize(most_nodes);
  are_worth_threads_ = num_entries >= worth_threads;
  work_->misfit.resize(most_points);
}

Constraints::~Constraints() = default;

void Constraints::project(NodeVector& v) const { project_out(v); }
void Constraints::project(FloatNodeVector& v) const { project_out(v); }

template <class Vector>
void Constraints::project_out(Vector& v) const {
  // Axes that share their clusters at once.
  using Scalar = typename Vector::Scalar;
  auto& work = work_->by_axis(Scalar{});
  for (std::size_t first = 0; first < 3; ++first) {
    if (std::find(clusters_.begin(), clusters_.begin() + first, clusters_[first]) != clusters_.begin() + first)
      continue;
    std::array<int, 3> axes{};
    Index count = 0;
    for (std::size_t axis = first; axis < 3; ++axis)
      if (clusters_[axis] == clusters_[first]) axes[static_cast<std::size_t>(count++)] = static_cast<int>(axis);
    const auto num_clusters = static_cast<std::ptrdiff_t>(clusters_[first].size());
#pragma omp parallel for schedule(dynamic) if (are_worth_threads_)
    for (std::ptrdiff_t c = 0; c < num_clusters; ++c) {
      const auto& cluster = clusters_[first][static_cast<std::size_t>(c)];
      auto nodal = work[static_cast<std::size_t>(c)].nodal.topLeftCorner(cluster->h.cols(), count);
      auto held = work[static_cast<std::size_t>(c)].held.topLeftCorner(cluster->h.cols(), count);
      const auto for_each_entry = [&](auto&& f) {
        for (std::size_t n = 0; n < cluster->nodes.size(); ++n)
          for (Index a = 0; a < count; ++a)
            f(v[3 * Index{cluster->nodes[n]} + axes[static_cast<std::size_t>(a)]], static_cast<Index>(n), a);
      };
      for_each_entry([&](Scalar value, Index n, Index a) { nodal(n, a) = value; });
      cluster->template into_span<Scalar>(nodal, held);
      for_each_entry([&](Scalar& value, Index n, Index a) { value -= held(n, a); });
    }
  }
}

void Constraints::prescribe(const std::vector<Vec3>& values) {
  bool same = true;
  for (std::size_t p = 0; p < points_.size(); ++p) {
    same = same && points_[p].value == values[p];
    points_[p].value = values[p];
  }
  if (same) return;
  for (std::size_t n = 0; n < own_point_.size(); ++n) held_[n].value = values[own_point_[n]];
  for (const HeldNodes& nodes : held_nodes_) nodes.prescribe(points_, held_);
}

void Constraints::for_each_held_entry(const std::function<void(Index, Index, double)>& f) const {
  for (int axis = 0; axis < 3; ++axis)
    for (const auto& cluster : clusters_[static_cast<std::size_t>(axis)]) {
      const MatrixXd& v = cluster->kept.vectors;
      const VectorXd& pressure = cluster->pressure_direction;
      const auto dof = [&](Index n) { return 3 * Index{cluster->nodes[static_cast<std::size_t>(n)]} + axis; };
      for (Index a = 0; a < v.rows(); ++a)
        for (Index b = 0; b < v.rows(); ++b) {
          double value = v.row(a).dot(v.row(b));
          if (pressure.size() > 0) value += pressure[a] * pressure[b];
          f(dof(a), dof(b), value);
        }
    }
}

void Constraints::lift(const NodeVector& u, NodeVector& d) const {
  d.setZero(u.size());
  for (int axis = 0; axis < 3; ++axis)
    for (const auto& cluster : clusters_[static_cast<std::size_t>(axis)]) {
      auto nodal = work_->nodal.head(cluster->h.cols());
      auto misfit = work_->misfit.head(cluster->h.rows());
      cluster->gather(u, axis, nodal);
      misfit.noalias() = cluster->h * nodal;
      for (std::size_t p = 0; p < cluster->points.size(); ++p)
        misfit[static_cast<Index>(p)] = held_[cluster->points[p]].value[axis] - misfit[static_cast<Index>(p)];
      cluster->displacement_for(misfit, work_->coefficients.head(cluster->kept.vectors.cols()), nodal);
      for (std::size_t n = 0; n < cluster->nodes.size(); ++n)
        d[3 * Index{cluster->nodes[n]} + axis] += nodal[static_cast<Index>(n)];
    }
}

std::vector<Vec3> Constraints::multipliers(const NodeVector& residual) const {
  std::vector<Vec3> forces(held_.size(), Vec3::Zero());
  for (int axis = 0; axis < 3; ++axis)
    for (const auto& cluster : clusters_[static_cast<std::size_t>(axis)]) {
      VectorXd nodal(cluster->h.cols());
      cluster->gather(residual, axis, nodal);
      const VectorXd lambda = cluster->forces_for(nodal);
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

bool Constraints::hold(const NodeVector& d, const NodeVector& u) const {
  constexpr double nothing = 1e-9;
  double largest = u.lpNorm<Eigen::Infinity>();
  for (const ConstraintPoint& p : points_)
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      if (p.axes[static_cast<std::size_t>(axis)]) largest = std::max(largest, std::abs(p.value[axis]));
  return d.lpNorm<Eigen::Infinity>() <= nothing * largest;
}

double Constraints::violation(const NodeVector& u) const { return lift(u).lpNorm<Eigen::Infinity>(); }

}  // namespace hexsolver
