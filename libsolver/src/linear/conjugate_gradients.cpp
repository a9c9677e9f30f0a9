// SPDX-License-Identifier: Apache-2.0
#include "linear/conjugate_gradients.h"

#include <Eigen/LU>

#include "core/parallel.h"
#include "core/stopwatch.h"
#include "hexmesh/core/interruption.h"

namespace hexsolver {

using Eigen::Index;

void BlockJacobi::update(const Potential& potential) {
  const Mesh& mesh = potential.mesh();
  inverse_.assign(mesh.num_all_nodes(), Mat3::Zero());
  mesh.for_each_cell([&](std::size_t c) {
    NodeBlocks blocks;
    blocks.fill(Mat3::Zero());
    potential.add_diagonal(c, blocks);
    for (std::size_t a = 0; a < 8; ++a) inverse_[mesh.node(c, a)] += blocks[a];
  });
  mesh.collect_blocks(inverse_);
  const auto count = static_cast<std::ptrdiff_t>(inverse_.size());
  for_each_node(count, [&](std::ptrdiff_t n) {
    Mat3& block = inverse_[n];
    block = Mat3(block.inverse());
  });
}

void BlockJacobi::apply(const NodeVector& r, NodeVector& z) const {
  z.resize(r.size());
  const auto count = static_cast<std::ptrdiff_t>(inverse_.size());
  for_each_node(count, [&](std::ptrdiff_t n) { z.segment<3>(3 * n) = inverse_[n] * r.segment<3>(3 * n); });
  constraints_.project(z);
}

ConjugateGradients::Outcome ConjugateGradients::solve(const Potential& potential, const Constraints& constraints,
                                                      const Preconditioner* preconditioner, const NodeVector& b,
                                                      const Options& options, NodeVector& d) {
  d.setZero(b.size());
  r_ = b;
  constraints.project(r_);
  const double whole = r_.norm();
  double target = options.relative_tolerance * whole;
  Outcome outcome;

  double curvature_of_first = 0;
  if (options.first_direction) {
    constexpr double noise = 1e-10;  // what is left of a direction that the supports hold
    first_ = *options.first_direction;
    constraints.project(first_);
    if (first_.norm() > noise * options.first_direction->norm()) {
      potential.apply(first_, of_first_);
      constraints.project(of_first_);
      curvature_of_first = first_.dot(of_first_);
    }
    if (curvature_of_first > 0) {
      const double alpha = first_.dot(r_) / curvature_of_first;
      d = alpha * first_;
      r_ -= alpha * of_first_;
    }
  }

  double rz = 0;
  for (bool is_first = true; outcome.iterations < options.most_iterations; is_first = false) {
    const double left = r_.norm();
    outcome.reduction = whole > 0 ? left / whole : 0;
    if (left <= target) {
      const double factor = options.excess ? options.excess(d) : 1;
      if (!(factor > 1)) return outcome;
      target = 0.9 * left / factor;
    }
    hexmesh::interruption_point();
    if (options.interrupt && options.interrupt()) {
      outcome.end = End::interrupted;
      return outcome;
    }
    const Stopwatch of_preconditioner;
    if (preconditioner)
      preconditioner->apply(r_, z_);
    else
      z_ = r_;
    outcome.preconditioner_seconds += of_preconditioner.seconds();
    const double rz_next = r_.dot(z_);
    if (!(rz_next > 0)) {
      outcome.end = End::indefinite_preconditioner;
      return outcome;
    }
    if (curvature_of_first > 0) z_ -= of_first_.dot(z_) / curvature_of_first * first_;
    if (is_first)
      p_ = z_;
    else
      p_ = z_ + rz_next / rz * p_;
    rz = rz_next;
    const Stopwatch of_product;
    potential.apply(p_, q_);
    constraints.project(q_);
    outcome.product_seconds += of_product.seconds();
    const double curvature = p_.dot(q_);
    ++outcome.iterations;
    if (!(curvature > 0)) {
      outcome.end = End::negative_curvature;
      return outcome;
    }
    const double alpha = rz / curvature;
    d += alpha * p_;
    r_ -= alpha * q_;
  }
  return outcome;
}

}  // namespace hexsolver
