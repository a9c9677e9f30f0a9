// SPDX-License-Identifier: Apache-2.0
#include "baseline/tet_system.h"

#include <Eigen/LU>
#include <algorithm>
#include <limits>

namespace hexsolver {
namespace {

/// Gradients of the shape functions by the barycentric coordinates, shape (nodes, 4).
Eigen::Matrix<double, Eigen::Dynamic, 4, 0, 10, 4> barycentric_gradients(const Eigen::Vector4d& b, bool is_quadratic) {
  Eigen::Matrix<double, Eigen::Dynamic, 4, 0, 10, 4> g;
  if (!is_quadratic) return Eigen::Matrix4d::Identity();
  g.setZero(10, 4);
  for (int a = 0; a < 4; ++a) g(a, a) = 4 * b[a] - 1;
  for (int e = 0; e < 6; ++e) {
    const auto [p, q] = hexmesh::tet_edges[static_cast<std::size_t>(e)];
    g(4 + e, p) = 4 * b[q];
    g(4 + e, q) = 4 * b[p];
  }
  return g;
}

/// Points of integration: the centre, or four that are exact for quadratic functions (Hammer, Stroud 1956).
std::vector<Eigen::Vector4d> integration_points(bool is_quadratic) {
  if (!is_quadratic) return {Eigen::Vector4d::Constant(0.25)};
  const double near = 0.58541019662496845446, far = 0.13819660112501051518;  // (5 + 3 sqrt 5) / 20, (5 - sqrt 5) / 20
  std::vector<Eigen::Vector4d> out;
  for (int a = 0; a < 4; ++a) {
    out.emplace_back(Eigen::Vector4d::Constant(far));
    out.back()[a] = near;
  }
  return out;
}

}  // namespace

TetSystem::TetSystem(const TetProblem& problem, TetLaw law)
    : problem_(problem), law_(law), nodes_each_(problem.mesh->nodes_each()) {
  const hexmesh::TetMesh& mesh = *problem.mesh;
  const std::vector<Eigen::Vector4d> rule = integration_points(mesh.is_quadratic());
  points_each_ = static_cast<int>(rule.size());
  for (std::size_t t = 0; t < mesh.size(); ++t) {
    const Mat3 frame = hexmesh::tet_frame(mesh, t), inverse = frame.inverse();
    Eigen::Matrix<double, 4, 3> of_barycentric;
    of_barycentric << -inverse.colwise().sum(), inverse;
    edges_.push_back(frame);
    for (const Eigen::Vector4d& b : rule)
      points_.push_back(
          {barycentric_gradients(b, mesh.is_quadratic()) * of_barycentric, frame.determinant() / (6.0 * points_each_)});
  }

  for (const auto& axes : problem.held)
    for (const bool held : axes) free_.push_back(held ? -1 : static_cast<std::int32_t>(num_free_++));
  const auto free_of = [&](std::size_t tet, int component) {
    return free_[3 * static_cast<std::size_t>(mesh.node(tet, component / 3)) + static_cast<std::size_t>(component % 3)];
  };
  const int size = 3 * nodes_each_;
  std::vector<std::vector<std::int32_t>> rows(static_cast<std::size_t>(num_free_));  // of each column, lower triangle
  for (std::size_t t = 0; t < mesh.size(); ++t)
    for (int c = 0; c < size; ++c)
      for (int r = 0; r < size; ++r)
        if (const std::int32_t column = free_of(t, c), row = free_of(t, r); column >= 0 && row >= column)
          rows[static_cast<std::size_t>(column)].push_back(row);
  std::vector<int> counts;
  for (auto& column : rows) {
    std::sort(column.begin(), column.end());
    column.erase(std::unique(column.begin(), column.end()), column.end());
    counts.push_back(static_cast<int>(column.size()));
  }
  matrix_.resize(num_free_, num_free_);
  matrix_.reserve(counts);
  for (std::size_t c = 0; c < rows.size(); ++c)
    for (const std::int32_t r : rows[c]) matrix_.insert(r, static_cast<Eigen::Index>(c)) = 0;
  matrix_.makeCompressed();
  for (std::size_t t = 0; t < mesh.size(); ++t)
    for (int c = 0; c < size; ++c)
      for (int r = 0; r < size; ++r) {
        const std::int32_t column = free_of(t, c), row = free_of(t, r);
        slot_.push_back(column >= 0 && row >= column
                            ? static_cast<std::int32_t>(&matrix_.coeffRef(row, column) - matrix_.valuePtr())
                            : -1);
      }
}

Mat3 TetSystem::deformation(std::size_t tet, const Point& point, const Vector& u) const {
  Mat3 f = Mat3::Identity();
  for (int a = 0; a < nodes_each_; ++a)
    f.noalias() += u.segment<3>(3 * Eigen::Index{problem_.mesh->node(tet, a)}) * point.gradients.row(a);
  return f;
}

TetSystem::Forces TetSystem::forces(const Vector& u) const {
  Forces out{0, std::numeric_limits<double>::infinity(), Vector::Zero(u.size()), Vector::Zero(u.size())};
  for (std::size_t t = 0; t < problem_.mesh->size(); ++t) {
    const hexmesh::Material& m = problem_.materials[t];
    const double shear = m.shear_modulus(), lambda = m.bulk_modulus() - 2 * shear / 3;
    Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, most_nodes> force;
    force.setZero(3, nodes_each_);
    for (int p = 0; p < points_each_; ++p) {
      const Point& point = points_[t * static_cast<std::size_t>(points_each_) + static_cast<std::size_t>(p)];
      const Mat3 f = deformation(t, point, u);
      const TetState state = tet_state(law_, f, edges_[t], shear, lambda);
      out.energy += point.volume * state.energy;
      out.min_jacobian = std::min(out.min_jacobian, f.determinant());
      force += point.volume * state.stress * point.gradients.transpose();
    }
    for (int a = 0; a < nodes_each_; ++a) {
      const Eigen::Index n = 3 * Eigen::Index{problem_.mesh->node(t, a)};
      out.gradient.segment<3>(n) += force.col(a);
      out.magnitude.segment<3>(n) += force.col(a).cwiseAbs();
    }
  }
  return out;
}

const TetSystem::Matrix& TetSystem::stiffness(const Vector& u, double projection, const Vector& held_step,
                                              Vector& pull) {
  const hexmesh::TetMesh& mesh = *problem_.mesh;
  const int size = 3 * nodes_each_;
  double* values = matrix_.valuePtr();
  std::fill_n(values, matrix_.nonZeros(), 0.0);
  pull.setZero(num_free_);
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3 * most_nodes, 3 * most_nodes> k(size, size);
  Eigen::Matrix<double, 9, Eigen::Dynamic, 0, 9, 3 * most_nodes> stress(9, size);
  for (std::size_t t = 0; t < mesh.size(); ++t) {
    const hexmesh::Material& m = problem_.materials[t];
    const double shear = m.shear_modulus(), lambda = m.bulk_modulus() - 2 * shear / 3;
    k.setZero();
    for (int p = 0; p < points_each_; ++p) {
      const Point& point = points_[t * static_cast<std::size_t>(points_each_) + static_cast<std::size_t>(p)];
      Tangent tangent = tet_state(law_, deformation(t, point, u), edges_[t], shear, lambda).tangent;
      const bool may_be_negative = law_ == TetLaw::corotational || law_ == TetLaw::green_lagrange;
      if (projection > 0 && may_be_negative) tangent = projected(tangent, projection);
      const Eigen::Matrix<double, 9, 9> of_gradient = point.volume * tangent_matrix(tangent);
      for (int b = 0; b < nodes_each_; ++b)
        stress.middleCols<3>(3 * b) = of_gradient.leftCols<3>() * point.gradients(b, 0) +
                                      of_gradient.middleCols<3>(3) * point.gradients(b, 1) +
                                      of_gradient.rightCols<3>() * point.gradients(b, 2);
      for (int a = 0; a < nodes_each_; ++a)
        k.middleRows<3>(3 * a) += point.gradients(a, 0) * stress.topRows<3>() +
                                  point.gradients(a, 1) * stress.middleRows<3>(3) +
                                  point.gradients(a, 2) * stress.bottomRows<3>();
    }
    const std::int32_t* slot = &slot_[t * static_cast<std::size_t>(size) * static_cast<std::size_t>(size)];
    for (int c = 0; c < size; ++c) {
      const Eigen::Index of_column = 3 * Eigen::Index{mesh.node(t, c / 3)} + c % 3;
      const double step = held_step[of_column];
      for (int r = 0; r < size; ++r) {
        if (const std::int32_t s = slot[r + size * c]; s >= 0) values[s] += k(r, c);
        if (step == 0) continue;
        const std::int32_t row =
            free_[3 * static_cast<std::size_t>(mesh.node(t, r / 3)) + static_cast<std::size_t>(r % 3)];
        if (row >= 0) pull[row] -= k(r, c) * step;
      }
    }
  }
  return matrix_;
}

TetSystem::Vector TetSystem::free_part(const Vector& all) const {
  Vector out(num_free_);
  for (std::size_t n = 0; n < free_.size(); ++n)
    if (free_[n] >= 0) out[free_[n]] = all[static_cast<Eigen::Index>(n)];
  return out;
}

TetSystem::Vector TetSystem::only_free(const Vector& free) const {
  Vector out(static_cast<Eigen::Index>(free_.size()));
  for (std::size_t n = 0; n < free_.size(); ++n) out[static_cast<Eigen::Index>(n)] = free_[n] < 0 ? 0 : free[free_[n]];
  return out;
}

TetSystem::Vector TetSystem::held_step(const Vector& u, double fraction) const {
  Vector step = Vector::Zero(u.size());
  for (std::size_t n = 0; n < free_.size(); ++n)
    if (free_[n] < 0)
      step[static_cast<Eigen::Index>(n)] =
          fraction * problem_.prescribed[n / 3][static_cast<Eigen::Index>(n % 3)] - u[static_cast<Eigen::Index>(n)];
  return step;
}

}  // namespace hexsolver
