// SPDX-License-Identifier: Apache-2.0
#include "constraints/constraints.h"

#include <Eigen/IterativeLinearSolvers>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "constraints/cluster.h"
#include "constraints/held_nodes.h"
#include "core/parallel.h"
#include "hexmesh/core/bytes.h"

namespace hexsolver {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

std::vector<ConstraintPoint> with_face_centers(const std::vector<ConstraintPoint>& points) {
  std::vector<ConstraintPoint> out;
  int of_face = 0;
  for (const ConstraintPoint& p : points) {
    if (of_face == 0) {
      out.push_back(p);
    } else {  // means of linear functions are their values in the middle
      out.back().weights += p.weights;
      out.back().value += p.value;
      out.back().area += p.area;
    }
    of_face = p.is_quarter ? (of_face + 1) % 4 : 0;
    if (p.is_quarter && of_face == 0) {
      out.back().weights /= 4;
      out.back().value /= 4;
      out.back().is_quarter = false;
    }
  }
  return out;
}

namespace {

/// Whether no cluster of the points can have more than `most` nodes.
bool all_are_small(const std::vector<ConstraintPoint>& points, std::size_t most) {
  std::vector<std::int32_t> cells;
  for (const ConstraintPoint& p : points) cells.push_back(p.cell);
  std::sort(cells.begin(), cells.end());
  return 8 * static_cast<std::size_t>(std::unique(cells.begin(), cells.end()) - cells.begin()) <= most;
}

}  // namespace

/// Replace the points of clusters with too many nodes by the nodes themselves.
void Constraints::hold_large_clusters_by_nodes() {
  std::vector<std::array<bool, 3>> axes(points_.size(), {false, false, false});
  std::vector<bool> is_sprung(points_.size());
  std::map<std::int32_t, ConstraintPoint> by_node;
  const bool all_small = all_are_small(points_, dense_limit);
  for (std::size_t p = 0; p < points_.size() && all_small; ++p) axes[p] = points_[p].axes;
  for (std::size_t axis = 0; axis < 3 && !all_small; ++axis)
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
      if (held_nodes_.back().is_soft())
        for (const std::size_t p : held_nodes_.back().members()) is_sprung[p] = true;
    }
  for (std::size_t p = 0; p < points_.size(); ++p) {
    if (!(axes[p][0] || axes[p][1] || axes[p][2] || is_sprung[p])) continue;
    own_point_.push_back(p);
    held_.push_back(points_[p]);
    held_.back().axes = axes[p];
    held_.back().is_soft = held_.back().is_soft || is_sprung[p];
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

bool Constraints::make_clusters(double part) {
  bool some_are_large = false;
  // Axes with the same points share their clusters.
  std::map<std::vector<std::size_t>, std::size_t> done;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    clusters_[axis].clear();
    std::vector<std::size_t> used = points_with_axis(held_, axis);
    if (const auto found = done.find(used); found != done.end()) {
      clusters_[axis] = clusters_[found->second];
      continue;
    }
    for (auto& members : split_into_clusters(mesh_, held_, used)) {
      bool has_faces = false, is_soft = false;
      double cells = 0;  // that have faces as large as the patch
      for (const std::size_t p : members) {
        has_faces = has_faces || held_[p].area > 0;
        is_soft = is_soft || held_[p].is_soft;
        const double face = std::pow(std::abs(mesh_.edges(held_[p].cell).determinant()), 2.0 / 3);
        cells += held_[p].area / held_[p].num_alike / face;
      }
      for (const std::size_t p : members) held_[p].is_soft = is_soft;
      const bool is_large = is_soft && cells >= cells_of_large_patch;
      some_are_large = some_are_large || is_large;
      const double cutoff = is_large    ? cutoff_of_large_soft_patches
                            : is_soft   ? part * cutoff_of_soft_faces
                            : has_faces ? part * cutoff_of_faces
                                        : cutoff_of_points;
      clusters_[axis].push_back(make_cluster(mesh_, held_, std::move(members), cutoff, is_large));
    }
    done[std::move(used)] = axis;
  }
  return some_are_large;
}

struct Constraints::Work {
  VectorXd nodal, coefficients, misfit;
  MatrixXd held;  ///< of one cluster, where it is asked for
  /// Of the nodes of each cluster, one axis after the other: clusters are worked on at once.
  template <class Scalar>
  struct ByAxis {
    std::vector<Scalar> nodal, held;
  };
  std::vector<ByAxis<double>> doubles;
  std::vector<ByAxis<float>> floats;
  std::vector<ByAxis<double>>& by_axis(double) { return doubles; }
  std::vector<ByAxis<float>>& by_axis(float) { return floats; }
};

Constraints::Constraints(const Mesh& mesh, std::vector<ConstraintPoint> points)
    : mesh_(mesh), points_(std::move(points)), work_(std::make_unique<Work>()) {
  hold_large_clusters_by_nodes();
  // A patch that is small beside its cells sees little of their turning: fewer directions are left free then. Springs
  // of a large one hold that.
  constexpr double enough = 0.1, least_cutoff = 0.01;
  const bool has_faces = std::any_of(held_.begin(), held_.end(), [](const ConstraintPoint& p) { return p.area > 0; });
  for (double part = 1;; part *= 0.4) {
    if (make_clusters(part)) break;
    if (!has_faces || part * cutoff_of_faces < least_cutoff || least_part_of_rigid_motions(mesh, clusters_) >= enough)
      break;
  }
  Index most_nodes = 0, most_points = 0, num_entries = 0;
  for (const auto& axis : clusters_)
    for (const auto& cluster : axis) {
      most_nodes = std::max(most_nodes, cluster->h.cols());
      most_points = std::max(most_points, cluster->h.rows());
      num_entries += static_cast<Index>(cluster->span.doubles.values.size());
    }
  work_->nodal.resize(most_nodes);
  for (const auto& axis : clusters_) {
    work_->doubles.resize(std::max(work_->doubles.size(), axis.size()));
    work_->floats.resize(work_->doubles.size());
    for (std::size_t n = 0; n < axis.size(); ++n) {
      const std::size_t size = std::max(work_->doubles[n].nodal.size(), 3 * axis[n]->span.doubles.rows);
      for (auto* numbers : {&work_->doubles[n].nodal, &work_->doubles[n].held}) numbers->resize(size);
      for (auto* numbers : {&work_->floats[n].nodal, &work_->floats[n].held}) numbers->resize(size);
    }
  }
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
    int count = 0;
    for (std::size_t axis = first; axis < 3; ++axis)
      if (clusters_[axis] == clusters_[first]) axes[count++] = static_cast<int>(axis);
    const auto num_clusters = static_cast<std::ptrdiff_t>(clusters_[first].size());
#pragma omp parallel for schedule(dynamic) if (are_worth_threads_)
    for (std::ptrdiff_t c = 0; c < num_clusters; ++c) {
      const auto& cluster = clusters_[first][c];
      const std::vector<std::int32_t>& nodes = cluster->nodes;
      const std::size_t rows = cluster->span.doubles.rows;
      Scalar* nodal = work[c].nodal.data();
      for (int a = 0; a < count; ++a) {
        for (std::size_t n = 0; n < nodes.size(); ++n) nodal[a * rows + n] = v[3 * Index{nodes[n]} + axes[a]];
        std::fill(nodal + a * rows + nodes.size(), nodal + (a + 1) * rows, Scalar(0));
      }
      cluster->take_out_held(count, nodal, work[c].held.data());
      for (int a = 0; a < count; ++a)
        for (std::size_t n = 0; n < nodes.size(); ++n) v[3 * Index{nodes[n]} + axes[a]] = nodal[a * rows + n];
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
    for (const auto& cluster : clusters_[axis]) {
      const MatrixXd& v = cluster->kept.vectors;
      if (work_->held.rows() < v.rows()) work_->held.resize(v.rows(), v.rows());
      auto held = work_->held.topLeftCorner(v.rows(), v.rows());
      held.noalias() = v * v.transpose();
      if (const VectorXd& p = cluster->pressure_direction; p.size() > 0) held.noalias() += p * p.transpose();
      const auto dof = [&](Index n) { return 3 * Index{cluster->nodes[n]} + axis; };
      for (Index b = 0; b < held.cols(); ++b)
        for (Index a = 0; a < held.rows(); ++a) f(dof(a), dof(b), held(a, b));
    }
}

template <class F>
void Constraints::for_each_lifted(const NodeVector& u, F&& f) const {
  for (int axis = 0; axis < 3; ++axis)
    for (const auto& cluster : clusters_[axis]) {
      auto nodal = work_->nodal.head(cluster->h.cols());
      auto misfit = work_->misfit.head(cluster->h.rows());
      cluster->gather(u, axis, nodal);
      misfit.noalias() = cluster->h * nodal;
      for (std::size_t p = 0; p < cluster->points.size(); ++p)
        misfit[p] = cluster->scale[p] * held_[cluster->points[p]].value[axis] - misfit[p];
      cluster->displacement_for(misfit, work_->coefficients.head(cluster->kept.vectors.cols()), nodal);
      for (std::size_t n = 0; n < cluster->nodes.size(); ++n) f(3 * Index{cluster->nodes[n]} + axis, nodal[n]);
    }
}

void Constraints::lift(const NodeVector& u, NodeVector& d) const {
  d.setZero(u.size());
  for_each_lifted(u, [&](Index dof, double by) { d[dof] = by; });
}

std::vector<Vec3> Constraints::multipliers(const NodeVector& residual) const {
  std::vector<Vec3> forces(held_.size(), Vec3::Zero());
  for (int axis = 0; axis < 3; ++axis)
    for (const auto& cluster : clusters_[axis]) {
      VectorXd nodal(cluster->h.cols());
      cluster->gather(residual, axis, nodal);
      const VectorXd lambda = cluster->forces_for(nodal);
      for (std::size_t p = 0; p < cluster->points.size(); ++p) forces[cluster->points[p]][axis] = lambda[p];
    }
  return forces;
}

bool Constraints::are_soft() const {
  return std::any_of(held_.begin(), held_.end(), [](const ConstraintPoint& p) { return p.is_soft; });
}

void Constraints::set_springs(const std::function<double(const ConstraintPoint&)>& stiffness) {
  for (std::size_t n = 0; n < own_point_.size(); ++n)
    if (held_[n].is_soft && held_[n].area > 0) held_[n].spring = stiffness(held_[n]);
}

std::vector<Vec3> Constraints::forces(const NodeVector& residual, const NodeVector& u) const {
  std::vector<Vec3> out = multipliers(residual);
  for (std::size_t n = 0; n < held_.size(); ++n)
    if (held_[n].spring > 0) out[n] += held_[n].spring * (held_[n].value - displacement(held_[n], u));
  return out;
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
      for (const std::size_t p : cluster->points) ++points[held_[p].condition];
      const auto most = std::max_element(points.begin(), points.end()) - points.begin();
      kept[most] += static_cast<std::size_t>(cluster->num_directions());
    }
  return kept;
}

std::vector<double> Constraints::incompatibility() const {
  std::vector<Vec3> miss(held_.size(), Vec3::Zero());
  for (int axis = 0; axis < 3; ++axis)
    for (const auto& cluster : clusters_[axis]) {
      VectorXd c(static_cast<Index>(cluster->points.size()));
      for (std::size_t p = 0; p < cluster->points.size(); ++p) c[p] = held_[cluster->points[p]].value[axis];
      if (c.maxCoeff() == c.minCoeff()) continue;  // a translation, which cells can always follow
      c = c.cwiseProduct(cluster->scale);
      Eigen::LeastSquaresConjugateGradient<Eigen::SparseMatrix<double>> solver(cluster->h);
      solver.setTolerance(1e-10);
      solver.setMaxIterations(300);
      const VectorXd u = solver.solve(c);
      const VectorXd rest = c - cluster->h * u;
      for (std::size_t p = 0; p < cluster->points.size(); ++p)
        miss[cluster->points[p]][axis] = rest[p] / cluster->scale[p];
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
      if (p.axes[axis]) largest = std::max(largest, std::abs(p.value[axis]));
  return d.lpNorm<Eigen::Infinity>() <= nothing * largest;
}

double Constraints::violation(const NodeVector& u) const {
  double largest = 0;
  for_each_lifted(u, [&](Index, double by) { largest = std::max(largest, std::abs(by)); });
  return largest;
}

std::size_t Constraints::bytes() const {
  std::set<const ConstraintCluster*> clusters;
  for (const auto& axis : clusters_)
    for (const auto& cluster : axis) clusters.insert(cluster.get());
  std::size_t sum = hexmesh::bytes_of(points_) + hexmesh::bytes_of(held_);
  for (const ConstraintCluster* c : clusters) sum += c->bytes();
  return sum;
}

}  // namespace hexsolver
