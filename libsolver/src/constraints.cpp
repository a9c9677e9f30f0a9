// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/constraints.h"

#include <Eigen/Eigenvalues>
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <map>
#include <numeric>

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

KeptDirections kept_directions(const MatrixXd& gram, double sigma2_max = 0) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(gram);
  const VectorXd& values = eigen.eigenvalues();  // ascending
  if (sigma2_max == 0) sigma2_max = values[values.size() - 1];
  const double least = Constraints::cutoff * Constraints::cutoff * sigma2_max;
  const Index dropped = std::lower_bound(values.begin(), values.end(), least) - values.begin();
  const Index kept = values.size() - dropped;
  return {eigen.eigenvectors().rightCols(kept), values.tail(kept)};
}

/// Sets of numbers joined pair by pair.
class Partition {
public:
  explicit Partition(std::size_t size) : parent_(size) { std::iota(parent_.begin(), parent_.end(), 0); }
  std::int32_t root(std::int32_t n) {
    while (parent_[static_cast<std::size_t>(n)] != n) {
      auto& p = parent_[static_cast<std::size_t>(n)];
      p = parent_[static_cast<std::size_t>(p)];
      n = p;
    }
    return n;
  }
  void join(std::int32_t a, std::int32_t b) {
    a = root(a);
    b = root(b);
    parent_[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
  }

private:
  std::vector<std::int32_t> parent_;
};

}  // namespace

/// Points that hang together through shared nodes, along one axis.
struct Constraints::Cluster {
  std::vector<std::size_t> points;   ///< rows of h
  std::vector<std::int32_t> nodes;   ///< columns of h
  SparseMatrix h;                    ///< (points, nodes)
  // Small clusters: h^T h = vectors diag(sigma2) vectors^T on the kept directions.
  KeptDirections kept;
  // Large clusters: rows that are orthonormal within each cell, times their sigma, and (rows rows^T + shift)^-1.
  SparseMatrix rows;
  SparseMatrix to_rows;  ///< rows = to_rows h
  Eigen::SimplicialLLT<SparseMatrix> factor;

  bool small() const { return nodes.size() <= dense_limit; }
  std::size_t num_kept() const { return static_cast<std::size_t>(small() ? kept.vectors.cols() : rows.rows()); }

  VectorXd gather(const NodeVector& v, int axis) const {
    VectorXd out(static_cast<Index>(nodes.size()));
    for (std::size_t n = 0; n < nodes.size(); ++n) out[static_cast<Index>(n)] = v[3 * Index{nodes[n]} + axis];
    return out;
  }

  /// Coefficients of the part of v (on the nodes) in the span of the kept directions.
  VectorXd into_span(const VectorXd& v) const {
    if (small()) return kept.vectors * (kept.vectors.transpose() * v);
    return rows.transpose() * solve_gram(rows * v);
  }

  /// mu with rows rows^T mu = b. The shift in the factor leaves 1e-8 / sigma^2 of each direction behind: refine.
  VectorXd solve_gram(const VectorXd& b) const {
    VectorXd mu = factor.solve(b);
    for (int pass = 0; pass < 4; ++pass) mu += factor.solve(b - rows * (rows.transpose() * mu));
    return mu;
  }

  /// d of smallest norm with h d = misfit in the kept directions.
  VectorXd solve_misfit(const VectorXd& misfit) const {
    if (small())
      return kept.vectors *
             (kept.vectors.transpose() * (h.transpose() * misfit)).cwiseQuotient(kept.sigma2);
    return rows.transpose() * solve_gram(to_rows * misfit);
  }

  /// lambda on the points with h^T lambda = r (the transposed problem).
  VectorXd solve_force(const VectorXd& r) const {
    if (small()) return h * (kept.vectors * (kept.vectors.transpose() * r).cwiseQuotient(kept.sigma2));
    return to_rows.transpose() * solve_gram(rows * r);
  }
};

namespace {

/// For large clusters: each cell's kept directions as rows.
void condense_by_cell(Constraints::Cluster& cluster, const std::vector<ConstraintPoint>& points) {
  std::map<std::int32_t, std::vector<Index>> by_cell;
  for (std::size_t p = 0; p < cluster.points.size(); ++p)
    by_cell[points[cluster.points[p]].cell].push_back(static_cast<Index>(p));
  std::vector<Eigen::Triplet<double>> entries;
  Index row = 0;
  for (const auto& [cell, members] : by_cell) {
    MatrixXd local(static_cast<Index>(members.size()), 8);
    for (std::size_t m = 0; m < members.size(); ++m)
      local.row(static_cast<Index>(m)) = points[cluster.points[static_cast<std::size_t>(members[m])]].weights;
    const KeptDirections kept = kept_directions(local.transpose() * local);
    // Left singular vectors U = local V / sigma: the row U^T h equals sigma V^T.
    const MatrixXd left = local * kept.vectors * kept.sigma2.cwiseSqrt().cwiseInverse().asDiagonal();
    for (Index k = 0; k < left.cols(); ++k, ++row)
      for (std::size_t m = 0; m < members.size(); ++m)
        entries.emplace_back(row, members[m], left(static_cast<Index>(m), k));
  }
  cluster.to_rows.resize(row, static_cast<Index>(cluster.points.size()));
  cluster.to_rows.setFromTriplets(entries.begin(), entries.end());
  cluster.rows = cluster.to_rows * cluster.h;
  SparseMatrix gram = cluster.rows * SparseMatrix(cluster.rows.transpose());
  const double shift = 1e-8 * VectorXd(gram.diagonal()).maxCoeff();
  for (Index r = 0; r < row; ++r) gram.coeffRef(r, r) += shift;
  cluster.factor.compute(gram);
}

std::shared_ptr<const Constraints::Cluster> make_cluster(const Mesh& mesh, const std::vector<ConstraintPoint>& points,
                                                         std::vector<std::size_t> members) {
  auto cluster = std::make_shared<Constraints::Cluster>();
  cluster->points = std::move(members);
  std::map<std::int32_t, Index> column;
  const auto each_weight = [&](auto&& f) {
    for (std::size_t row = 0; row < cluster->points.size(); ++row) {
      const ConstraintPoint& p = points[cluster->points[row]];
      for (int a = 0; a < 8; ++a)
        if (p.weights[a] != 0)
          f(static_cast<Index>(row), mesh.cell_nodes()[static_cast<std::size_t>(p.cell)][static_cast<std::size_t>(a)],
            p.weights[a]);
    }
  };
  each_weight([&](Index, std::int32_t node, double) { column[node] = 0; });
  for (auto& [node, number] : column) {
    number = static_cast<Index>(cluster->nodes.size());
    cluster->nodes.push_back(node);
  }
  std::vector<Eigen::Triplet<double>> entries;
  each_weight([&](Index row, std::int32_t node, double weight) { entries.emplace_back(row, column[node], weight); });
  cluster->h.resize(static_cast<Index>(cluster->points.size()), static_cast<Index>(cluster->nodes.size()));
  cluster->h.setFromTriplets(entries.begin(), entries.end());
  if (cluster->small()) {
    const MatrixXd gram = MatrixXd(SparseMatrix(cluster->h.transpose()) * cluster->h);
    cluster->kept = kept_directions(gram);
  } else {
    condense_by_cell(*cluster, points);
  }
  return cluster;
}

}  // namespace

Constraints::Constraints(const Mesh& mesh, std::vector<ConstraintPoint> points)
    : mesh_(mesh), points_(std::move(points)) {
  // Axes with the same points share their clusters.
  std::map<std::vector<std::size_t>, std::size_t> done;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<std::size_t> used;
    for (std::size_t p = 0; p < points_.size(); ++p)
      if (points_[p].axes[axis]) used.push_back(p);
    if (const auto found = done.find(used); found != done.end()) {
      clusters_[axis] = clusters_[found->second];
      continue;
    }
    Partition partition(mesh.num_nodes());
    const auto nodes = [&](std::size_t p) { return mesh.cell_nodes()[static_cast<std::size_t>(points_[p].cell)]; };
    std::vector<std::int32_t> first(used.size(), -1);
    for (std::size_t n = 0; n < used.size(); ++n)
      for (int a = 0; a < 8; ++a) {
        if (points_[used[n]].weights[a] == 0) continue;
        const std::int32_t node = nodes(used[n])[static_cast<std::size_t>(a)];
        if (first[n] < 0) first[n] = node;
        partition.join(first[n], node);
      }
    std::map<std::int32_t, std::vector<std::size_t>> members;
    for (std::size_t n = 0; n < used.size(); ++n) members[partition.root(first[n])].push_back(used[n]);
    for (auto& [root, list] : members) clusters_[axis].push_back(make_cluster(mesh, points_, std::move(list)));
    done[std::move(used)] = axis;
  }
}

Constraints::~Constraints() = default;

void Constraints::project(NodeVector& v) const {
  for (int axis = 0; axis < 3; ++axis)
    for (const auto& cluster : clusters_[static_cast<std::size_t>(axis)]) {
      const VectorXd held = cluster->into_span(cluster->gather(v, axis));
      for (std::size_t n = 0; n < cluster->nodes.size(); ++n)
        v[3 * Index{cluster->nodes[n]} + axis] -= held[static_cast<Index>(n)];
    }
}

NodeVector Constraints::lift(const NodeVector& u, double fraction) const {
  NodeVector d = NodeVector::Zero(u.size());
  for (int axis = 0; axis < 3; ++axis)
    for (const auto& cluster : clusters_[static_cast<std::size_t>(axis)]) {
      VectorXd misfit = -(cluster->h * cluster->gather(u, axis));
      for (std::size_t p = 0; p < cluster->points.size(); ++p)
        misfit[static_cast<Index>(p)] += fraction * points_[cluster->points[p]].value[axis];
      const VectorXd correction = cluster->solve_misfit(misfit);
      for (std::size_t n = 0; n < cluster->nodes.size(); ++n)
        d[3 * Index{cluster->nodes[n]} + axis] += correction[static_cast<Index>(n)];
    }
  return d;
}

std::vector<Vec3> Constraints::multipliers(const NodeVector& residual) const {
  std::vector<Vec3> forces(points_.size(), Vec3::Zero());
  for (int axis = 0; axis < 3; ++axis)
    for (const auto& cluster : clusters_[static_cast<std::size_t>(axis)]) {
      const VectorXd lambda = cluster->solve_force(cluster->gather(residual, axis));
      for (std::size_t p = 0; p < cluster->points.size(); ++p)
        forces[cluster->points[p]][axis] = lambda[static_cast<Index>(p)];
    }
  return forces;
}

Vec3 Constraints::displacement(const ConstraintPoint& point, const NodeVector& u) const {
  Vec3 moved = Vec3::Zero();
  for (int a = 0; a < 8; ++a)
    moved += point.weights[a] *
             u.segment<3>(3 * Index{mesh_.cell_nodes()[static_cast<std::size_t>(point.cell)][static_cast<std::size_t>(a)]});
  return moved;
}

std::size_t Constraints::num_kept() const {
  std::size_t kept = 0;
  for (const auto& axis : clusters_)
    for (const auto& cluster : axis) kept += cluster->num_kept();
  return kept;
}

std::vector<double> Constraints::contradiction() const {
  std::vector<Vec3> miss(points_.size(), Vec3::Zero());
  for (int axis = 0; axis < 3; ++axis)
    for (const auto& cluster : clusters_[static_cast<std::size_t>(axis)]) {
      VectorXd c(static_cast<Index>(cluster->points.size()));
      for (std::size_t p = 0; p < cluster->points.size(); ++p)
        c[static_cast<Index>(p)] = points_[cluster->points[p]].value[axis];
      Eigen::LeastSquaresConjugateGradient<SparseMatrix> solver(cluster->h);
      solver.setTolerance(1e-10);
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
